// What the program's pages have in common: policy, styles, scripts, data, navigation.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/text_table.h"
#include "common/json/json.h"

namespace gapfarm {

// The data of a page that has no plots, and of one without trials.
Json no_plots();
Json no_trials();

struct PageFrame {
  std::string title;
  std::string brand;                                        // "diagnosis", "run"
  std::vector<std::pair<const char*, const char*>> places;  // of the navigation: id and words
  std::string body;                                         // sections
  // A section, and its place in the navigation; nothing where it is empty.
  void add(const char* id, const char* place, const std::string& section);
  // By a server: the page has a way back to the list and looks again while it is open.
  bool served = false;
};

// One self-contained file, UTF-8: no network, its own scripts and styles only, named by their
// hashes in its content security policy.  `page` and `trials` are the data of its plots; its words
// are explained at the end.
std::string framed_page(PageFrame frame, Json page, const Json& trials);
std::string framed_page(PageFrame frame);  // one without plots

// Without scripts the plots have nothing to show; everything else is text.
extern const char* const kNoScript;

// Where the page's scripts draw: controls, and beneath them one plot or a grid of them.
std::string plot_area(std::string_view name);
std::string plot_grid(std::string_view name);

// What a page calls the two models of its trials.
struct ModelNames {
  std::string_view tuned, final_;
};

// The sections that only hold plots of trials.  Texts are HTML.
std::string floor_section();
std::string drives_section(const ModelNames& models);
std::string poses_section(std::string_view heading, std::string_view text,
                          const ModelNames& models);
// The end of a section.
std::string residual_plots(std::string_view heading, std::string_view text,
                           const ModelNames& models);
// Any trial, played; of pages that a server shows.  `what`: "drive", "push" or "window".
std::string watch_section(std::string_view what);

// A self-contained HTML page of text, tables and SVG pictures, without scripts.
class PlainPage {
 public:
  explicit PlainPage(std::string title) : title_(std::move(title)) {}

  void heading(std::string_view content);
  void paragraph(std::string_view content);
  // Columns after the first are aligned to the right.
  void table(const TextTable& table);
  // `svg` as Svg::finish() gives it; `words` describe it to those who cannot see it.
  void picture(std::string_view svg, std::string_view content);

  // The whole file, UTF-8; the same calls give the same bytes.
  std::string finish() const;

 private:
  std::string title_;
  std::string body_;
};

// Contents of the style sheets and scripts, in the order in which a page needs them.
std::span<const std::string_view> page_styles();
std::span<const std::string_view> page_scripts();

}  // namespace gapfarm
