#include "print_page.hpp"

#include <fmt/format.h>

#include "svg_panel.hpp"

namespace berth::cli {
namespace {

constexpr double kPoint_mm = 25.4 / 72;  // PDF's unit

/// Text of a PDF string: parentheses and backslashes are its syntax.
std::string pdf_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '(' || c == ')' || c == '\\') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

}  // namespace

std::string PrintPage::svg() const {
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.4f}mm\" height=\"{1:.4f}mm\" viewBox=\"0 0 {0:.4f} "
      "{1:.4f}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<g shape-rendering=\"crispEdges\">\n",
      width_, height_);
  for (const Rectangle& r : rectangles_) {
    out += fmt::format("<rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\"/>\n", r.x, r.y, r.width,
                       r.height);
  }
  out += "</g>\n";
  for (const Disc& d : discs_) {
    out += fmt::format("<circle cx=\"{:.4f}\" cy=\"{:.4f}\" r=\"{:.4f}\"{}/>\n", d.x, d.y, d.radius,
                       d.light ? " fill=\"#fff\"" : "");
  }
  for (const Line& l : lines_) {
    out += fmt::format(
        "<line x1=\"{:.4f}\" y1=\"{:.4f}\" x2=\"{:.4f}\" y2=\"{:.4f}\" stroke=\"#000\" stroke-width=\"{:.4f}\"/>\n",
        l.x0, l.y0, l.x1, l.y1, l.width);
  }
  for (const Text& t : texts_) {
    out += fmt::format(
        "<text x=\"{:.4f}\" y=\"{:.4f}\" font-family=\"Helvetica,Arial,sans-serif\" font-size=\"{:.4f}\">{}</text>\n",
        t.x, t.y, t.height, svg_escaped(t.words));
  }
  return out + "</svg>\n";
}

std::string PrintPage::pdf() const {
  // Millimetres with y down from here on; text is turned upright again.
  std::string content = fmt::format("{0:.8f} 0 0 -{0:.8f} 0 {1:.4f} cm\n", 1 / kPoint_mm, height_ / kPoint_mm);
  for (const Rectangle& r : rectangles_) {
    content += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re f\n", r.x, r.y, r.width, r.height);
  }
  for (const Disc& d : discs_) {
    // Four of Bezier's cubics: off the circle by 0.0003 of its radius at most.
    constexpr double kHandle = 0.5522847498;
    const double r = d.radius, h = kHandle * r;
    content += fmt::format("{} g {:.4f} {:.4f} m", d.light ? 1 : 0, d.x + r, d.y);
    const double turns[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (int i = 0; i < 4; ++i) {
      const double ax = turns[i][0], ay = turns[i][1], bx = turns[(i + 1) % 4][0], by = turns[(i + 1) % 4][1];
      content +=
          fmt::format(" {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} c", d.x + r * ax + h * bx, d.y + r * ay + h * by,
                      d.x + r * bx + h * ax, d.y + r * by + h * ay, d.x + r * bx, d.y + r * by);
    }
    content += " f 0 g\n";
  }
  for (const Line& l : lines_) {
    content += fmt::format("{:.4f} w {:.4f} {:.4f} m {:.4f} {:.4f} l S\n", l.width, l.x0, l.y0, l.x1, l.y1);
  }
  for (const Text& t : texts_) {
    content += fmt::format("BT /F1 {:.4f} Tf 1 0 0 -1 {:.4f} {:.4f} Tm ({}) Tj ET\n", t.height, t.x, t.y,
                           pdf_escaped(t.words));
  }
  const std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format(
          "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 5 0 R /Resources << /Font << /F1 "
          "4 0 R >> >> >>",
          width_ / kPoint_mm, height_ / kPoint_mm),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
      fmt::format("<< /Length {} >>\nstream\n{}endstream", content.size(), content)};
  std::string out = "%PDF-1.6\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010d} 00000 n \n", out.size());
    out += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  const std::size_t start = out.size();
  return out + table +
         fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", objects.size() + 1, start);
}

}  // namespace berth::cli
