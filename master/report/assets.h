// What a page is made of beside its text, packed into the program at build time (embed.cmake).
#pragma once

#include <span>
#include <string_view>

namespace gapfarm {

// Contents of the style sheets and scripts, in the order in which a page needs them.
std::span<const std::string_view> page_styles();
std::span<const std::string_view> page_scripts();

}  // namespace gapfarm
