// berth eval: a network judged on a set of labelled images.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/block_picture.hpp"
#include "support/command_run.hpp"
#include "support/pictures.hpp"

namespace berth {
namespace {

using test::run_berth;
using test::ScratchFolder;
using testing::HasSubstr;

const std::string kTiny = std::string(BERTH_SOURCE_DIR) + "/training/tests/data/tiny.berthnet";
const std::string kHeader =
    "index,part,class,subject,visible,x0,y0,x1,y1,full_x0,full_y0,full_x1,full_y1,d_px,x,y,depth_m,range_m,focal_px,"
    "axis_x,axis_y,light,background,livery\n";

/// Four images of noise, the last two the test, one of them with a target.
void write_set(const ScratchFolder& folder) {
  std::string labels = kHeader;
  labels += "0,train,1,target,1.0,0,0,9,9,0,0,9,9,80.0,120.0,130.0,2.0,2.1,600,128,128,sun,lab-1,gold-foil\n";
  labels += "1,train,0,background,0.0,0,0,0,0,0,0,0,0,0,0,0,0,0,600,128,128,lamps,lab-2,\n";
  labels += "2,test,1,target,0.9,0,0,9,9,0,0,9,9,80.0,120.0,130.0,2.0,2.1,600,128,128,sun,lab-3,gold-foil\n";
  labels += "3,test,0,robot,0.0,0,0,0,0,0,0,0,0,0,0,0,0,0,600,128,128,lamps,lab-4,\n";
  folder.write("labels.csv", labels);
  pictures::Random random(3);
  std::vector<u8> pixels(4 * 256 * 256);
  for (u8& pixel : pixels) pixel = static_cast<u8>(random.below(256));
  folder.write("images.u8", pixels);
}

TEST(CliEval, JudgesTheTestPartAndComparesBackends) {
  const ScratchFolder folder;
  write_set(folder);
  const test::CommandRun run = run_berth({"eval", kTiny, folder.path(), "--backend", "simd,reference"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("on 2 images of"));
  EXPECT_THAT(run.out, HasSubstr("| simd |"));
  EXPECT_THAT(run.out, HasSubstr("| reference |"));
  EXPECT_THAT(run.out, HasSubstr("errors of 2:"));
  EXPECT_THAT(run.out, HasSubstr("| 0.45 |"));
  EXPECT_THAT(run.out, HasSubstr("| robot | 0 | 0 |"));
  EXPECT_EQ(run.out.find("differs"), std::string::npos);
}

TEST(CliEval, SetsOrbBesideTheNetworkAndDraws) {
  const ScratchFolder folder;
  folder.write("labels.csv",
               kHeader +
                   "0,train,1,target,1.0,30,30,225,225,30,30,225,225,180.0,128,128,2.0,2.1,600,128,128,sun,lab-1,gold\n"
                   "1,test,1,target,1.0,30,30,225,225,30,30,225,225,180.0,135,135,2.0,2.1,600,128,128,sun,lab-1,gold\n"
                   "2,test,0,robot,0.0,0,0,0,0,0,0,0,0,0,0,0,0,0,600,128,128,lamps,lab-4,\n");
  std::vector<u8> pixels = test::block_picture(1, 256);
  for (const std::vector<u8>& more : {test::block_picture(1, 256, 7), std::vector<u8>(256 * 256, 90)}) {
    pixels.insert(pixels.end(), more.begin(), more.end());
  }
  folder.write("images.u8", pixels);
  const std::string plots = folder / "new/plots";
  const test::CommandRun run = run_berth({"eval", kTiny, folder.path(), "--orb", "--plots", plots});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("ORB: 500 features, 1 views of the training part"));
  for (const char* ratio : {"0.45", "0.80"}) {
    EXPECT_THAT(run.out,
                testing::ContainsRegex("\n\\| " + std::string(ratio) +
                                       " \\| [0-9.]+ \\| [0-9.]+ \\| 100.00 \\| 0.00 \\| 100.00 \\| 0.00 \\|\n"));
  }
  EXPECT_THAT(run.out, HasSubstr("| to 3.0 m | 1 |"));
  EXPECT_THAT(run.out, HasSubstr("written: " + plots + "/roc.svg"));
  EXPECT_THAT(test::text_of(plots + "/roc.svg"), HasSubstr("ORB, homography, ratio 0.45 to 0.80"));
  EXPECT_THAT(test::text_of(plots + "/precision-recall.svg"), HasSubstr("tiny, area under the curve"));

  const test::CommandRun refused =
      run_berth({"eval", kTiny, folder.path(), "--plots", folder.write("file", std::string("x")) + "/below"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("choose another for --plots"));
}

TEST(CliEval, SaysWhatIsWrongWithASet) {
  const ScratchFolder folder;
  EXPECT_THAT(run_berth({"eval", kTiny, folder.path()}).err, HasSubstr("labels.csv: cannot be read"));
  write_set(folder);
  EXPECT_THAT(run_berth({"eval", "no.berthnet", folder.path()}).err, HasSubstr("no.berthnet: No such file"));
  folder.write("images.u8", std::string(100, 'x'));
  EXPECT_THAT(run_berth({"eval", kTiny, folder.path()}).err, HasSubstr("images.u8: does not have the 262144 bytes"));
  folder.write("labels.csv", kHeader + "0,test,present,target\n");
  const test::CommandRun run = run_berth({"eval", kTiny, folder.path()});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("line 2: field 'class' is 'present', not a number"));
  folder.write("labels.csv", kHeader);
  EXPECT_THAT(run_berth({"eval", kTiny, folder.path()}).err, HasSubstr("has no image of the part 'test'"));
}

}  // namespace
}  // namespace berth
