// The words of a page that need an explanation.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gapfarm {

// `words` as a link to what the glossary says of `id`; pages show that beside it on hover or focus.
// REQUIRES: the glossary has `id`.
std::string term(std::string_view id, std::string_view shown);

// The section with the explanations of `ids`, in this order; it prints, too.
std::string glossary_section(const std::vector<std::string_view>& ids);

// What the pages of a diagnosis and of a run explain.
const std::vector<std::string_view>& diagnosis_terms();
const std::vector<std::string_view>& run_terms();

}  // namespace gapfarm
