// The OpenCL backend's kernel cache: what it keeps, what it notices, and that nothing depends on it.
#ifdef BERTH_WITH_OPENCL
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "berth/error.hpp"
#include "crc32.hpp"
#include "kernel_text.hpp"
#include "opencl/opencl.hpp"
#include "opencl/program.hpp"
#include "support/scratch_folder.hpp"

namespace berth::opencl {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<unsigned char>;

class OpenclCache : public ::testing::Test {
 protected:
  std::string folder(const std::string& name) const { return scratch_ / name; }
  static Bytes read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static void write(const std::string& path, const Bytes& bytes) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  static std::size_t files_in(const std::string& path) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }

  test::ScratchFolder scratch_;
};

const Bytes kBinary = {0, 1, 2, 253, 254, 255, 10, 13};

TEST_F(OpenclCache, ChecksAndNamesWithKnownHashes) {
  const std::string digits = "123456789";
  EXPECT_EQ(crc32(reinterpret_cast<const unsigned char*>(digits.data()), digits.size()), 0xcbf43926u);
  EXPECT_EQ(crc32(nullptr, 0), 0u);
  EXPECT_EQ(hash_hex(""), "cbf29ce484222325cbf29ce484222325");
  EXPECT_EQ(hash_hex("a"), "af63dc4c8601ec8caf63bd4c8601b7be");
}

TEST_F(OpenclCache, GivesBackWhatItWasGiven) {
  const BinaryCache cache(folder("deep/er"));
  EXPECT_TRUE(cache.load("device A").empty());
  EXPECT_TRUE(cache.store("device A", kBinary));
  EXPECT_EQ(cache.load("device A"), kBinary);
  EXPECT_TRUE(cache.load("device B").empty());
  EXPECT_EQ(files_in(cache.folder()), 1u) << "no temporary file is left";
  EXPECT_TRUE(cache.store("device A", {9}));
  EXPECT_EQ(cache.load("device A"), Bytes{9});
}

TEST_F(OpenclCache, TakesADamagedFileForNone) {
  const BinaryCache cache(folder("c"));
  ASSERT_TRUE(cache.store("device A", kBinary));
  const std::string path = cache.path_of("device A");
  const Bytes whole = read(path);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write(path, Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_TRUE(cache.load("device A").empty()) << "cut to " << size;
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    Bytes damaged = whole;
    damaged[at] ^= 0x10;
    write(path, damaged);
    EXPECT_TRUE(cache.load("device A").empty()) << "byte " << at;
  }
  Bytes longer = whole;
  longer.push_back(0);
  write(path, longer);
  EXPECT_TRUE(cache.load("device A").empty());
  write(path, whole);
  EXPECT_EQ(cache.load("device A"), kBinary);
}

TEST_F(OpenclCache, TakesAnotherIdentitysFileForNone) {
  const BinaryCache cache(folder("c"));
  ASSERT_TRUE(cache.store("device A", kBinary));
  fs::rename(cache.path_of("device A"), cache.path_of("device B"));  // as if their hashes were equal
  EXPECT_TRUE(cache.load("device B").empty());
}

TEST_F(OpenclCache, DoesWithoutAFolder) {
  write(folder("file"), {1});
  for (const std::string& where : {std::string(), folder("file"), folder("file/below"), std::string("/proc/berth")}) {
    const BinaryCache cache(where);
    EXPECT_FALSE(cache.store("device A", kBinary)) << where;
    EXPECT_TRUE(cache.load("device A").empty()) << where;
  }
  const BinaryCache cache(folder("c"));
  fs::create_directories(cache.path_of("device A"));  // a folder where the file should be
  EXPECT_FALSE(cache.store("device A", kBinary));
  EXPECT_TRUE(cache.load("device A").empty());
  EXPECT_EQ(files_in(cache.folder()), 1u) << "no temporary file is left";
}

/// Sets variables for one test; an empty value unsets.
class Environment {
 public:
  void set(const char* name, const std::string& value) {
    const char* before = std::getenv(name);
    saved_.push_back({name, before != nullptr, before != nullptr ? before : ""});
    value.empty() ? unsetenv(name) : setenv(name, value.c_str(), 1);
  }
  ~Environment() {
    for (auto saved = saved_.rbegin(); saved != saved_.rend(); ++saved) {
      saved->was_set ? setenv(saved->name, saved->value.c_str(), 1) : unsetenv(saved->name);
    }
  }

 private:
  struct Saved {
    const char* name;
    bool was_set;
    std::string value;
  };
  std::vector<Saved> saved_;
};

TEST_F(OpenclCache, LiesWhereTheUserWants) {
  Environment environment;
  environment.set("XDG_CACHE_HOME", "/x");
  environment.set("HOME", "/h");
  EXPECT_EQ(cache_folder("/chosen"), "/chosen");
  EXPECT_EQ(cache_folder(""), "/x/berth");
  environment.set("XDG_CACHE_HOME", "relative");
  EXPECT_EQ(cache_folder(""), "/h/.cache/berth");
  environment.set("XDG_CACHE_HOME", "");
  EXPECT_EQ(cache_folder(""), "/h/.cache/berth");
  environment.set("HOME", "");
  EXPECT_EQ(cache_folder(""), "");
  EXPECT_EQ(kernel_cache({}).path, "");
  EXPECT_EQ(kernel_cache({}).entries, 0u);
}

TEST_F(OpenclCache, TellsWhatItHolds) {
  BackendOptions options;
  options.cache_dir = folder("c");
  EXPECT_EQ(kernel_cache(options).entries, 0u);
  const BinaryCache cache(options.cache_dir);
  ASSERT_TRUE(cache.store("device A", kBinary));
  ASSERT_TRUE(cache.store("device B", kBinary));
  write(folder("c/notes.txt"), {1});
  const CacheInfo info = kernel_cache(options);
  EXPECT_EQ(info.path, options.cache_dir);
  EXPECT_EQ(info.entries, 2u);
  EXPECT_EQ(info.bytes, fs::file_size(cache.path_of("device A")) + fs::file_size(cache.path_of("device B")));
}

TEST_F(OpenclCache, AnswersToEverythingAProgramDependsOn) {
  Device device;
  device.name = "name";
  device.vendor = "vendor";
  device.driver_version = "1";
  device.platform_name = "platform";
  device.platform_version = "2";
  const std::string identity = program_identity(device, "source");
  const auto changed = [&](std::string Device::*field) {
    Device other = device;
    other.*field += "x";
    return program_identity(other, "source");
  };
  EXPECT_NE(changed(&Device::name), identity);
  EXPECT_NE(changed(&Device::vendor), identity);
  EXPECT_NE(changed(&Device::driver_version), identity);
  EXPECT_NE(changed(&Device::platform_name), identity);
  EXPECT_NE(changed(&Device::platform_version), identity);
  EXPECT_NE(program_identity(device, "sourcf"), identity);
  EXPECT_EQ(program_identity(device, "source"), identity);
  EXPECT_THAT(identity, ::testing::HasSubstr("-cl-std=CL1.2"));
}

/// With a small program of its own on the first device, where there is one.
class OpenclPrograms : public OpenclCache {
 protected:
  void SetUp() override {
    std::string absent;
    if (devices(absent).empty()) GTEST_SKIP() << absent;
    api_ = load_api();
    device_ = find_devices(api_).front();
    cl_int status = CL_SUCCESS;
    context_ = {api_.clCreateContext(nullptr, 1, &device_.id, nullptr, nullptr, &status), api_.clReleaseContext};
    ASSERT_EQ(status, CL_SUCCESS);
  }
  BuiltProgram build(const BinaryCache& cache, const std::string& source = "__kernel void nothing(void) {}\n") {
    return build_program(api_, context_.get(), device_, source, cache);
  }
  bool has_kernel(const BuiltProgram& built) {
    cl_int status = CL_SUCCESS;
    const Handle<cl_kernel> kernel(api_.clCreateKernel(built.program.get(), "nothing", &status), api_.clReleaseKernel);
    return status == CL_SUCCESS;
  }

  Api api_;
  Device device_;
  Handle<cl_context> context_;
};

TEST_F(OpenclPrograms, AreCompiledOnce) {
  const BinaryCache cache(folder("c"));
  EXPECT_FALSE(build(cache).from_cache);
  const BuiltProgram second = build(cache);
  EXPECT_TRUE(second.from_cache);
  EXPECT_TRUE(has_kernel(second));
  EXPECT_FALSE(build(cache, "__kernel void nothing(void) { }\n").from_cache);
  EXPECT_EQ(files_in(cache.folder()), 2u);
}

TEST_F(OpenclPrograms, ReplaceADamagedCacheFile) {
  const BinaryCache cache(folder("c"));
  build(cache);
  const fs::path path = fs::directory_iterator(cache.folder())->path();
  const Bytes whole = read(path.string());
  Bytes damaged = whole;
  damaged[damaged.size() / 2] ^= 1;
  write(path.string(), damaged);
  const BuiltProgram rebuilt = build(cache);
  EXPECT_FALSE(rebuilt.from_cache);
  EXPECT_TRUE(has_kernel(rebuilt));
  EXPECT_TRUE(build(cache).from_cache);
}

TEST_F(OpenclPrograms, ReplaceABinaryThatTheDriverDoesNotTake) {
  const BinaryCache cache(folder("c"));
  const std::string source = "__kernel void nothing(void) {}\n";
  ASSERT_TRUE(cache.store(program_identity(device_, source), Bytes(1000, 0x5a)));
  const BuiltProgram rebuilt = build(cache, source);
  EXPECT_FALSE(rebuilt.from_cache);
  EXPECT_TRUE(has_kernel(rebuilt));
  EXPECT_TRUE(build(cache, source).from_cache);
}

TEST_F(OpenclPrograms, BuildWithoutACache) {
  write(folder("file"), {1});
  for (const std::string& where : {std::string(), folder("file/below")}) {
    const BuiltProgram built = build(BinaryCache(where));
    EXPECT_FALSE(built.from_cache);
    EXPECT_TRUE(has_kernel(built));
  }
}

TEST_F(OpenclPrograms, SayWhereTheSourceIsWrong) {
  const std::string source = join({{"good.inl", "// nothing\n"}, {"bad.inl", "\n__kernel void broken( {}\n"}});
  try {
    build(BinaryCache(""), source);
    FAIL() << "built";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                ::testing::StartsWith("opencl: building the kernels for " + device_.name + " failed (-11"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("kernels/bad.inl:2"));
  }
}

}  // namespace
}  // namespace berth::opencl
#endif
