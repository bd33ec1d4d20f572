// What the page is made of beside its text, packed into the program at build time (embed.cmake).
#pragma once

#include <span>
#include <string_view>

namespace gapfarm {

// Contents of the style sheets and scripts, in the order in which a page needs them.  When the
// build had no npm, uPlot is not among them and the page draws its plots as SVG.
std::span<const std::string_view> page_styles();
std::span<const std::string_view> page_scripts();

// "uPlot 1.6.32", or what the page draws with instead.
std::string_view plot_library();

}  // namespace gapfarm
