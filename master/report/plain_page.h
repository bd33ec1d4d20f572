// A self-contained HTML page of text, tables and SVG pictures, without scripts.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gapfarm {

class PlainPage {
 public:
  explicit PlainPage(std::string title) : title_(std::move(title)) {}

  void heading(std::string_view content);
  void paragraph(std::string_view content);
  // Columns after the first are aligned to the right.
  void table(const std::vector<std::string>& header,
             const std::vector<std::vector<std::string>>& rows);
  // `svg` as Svg::finish() gives it; `words` describe it to those who cannot see it.
  void picture(std::string_view svg, std::string_view content);

  // The whole file, UTF-8; the same calls give the same bytes.
  std::string finish() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace gapfarm
