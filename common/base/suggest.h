// "Did you mean": the nearest of some known words.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace gapfarm {

// The known word with the least edit distance (a swap of neighbours is one edit) to `word`, when
// that is at most a third of the longer word's length (at least 1); empty otherwise.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

// "; did you mean 'forward'?" or, when nothing is near, "; known: a, b, c".
std::string suggestion(std::string_view word, std::span<const std::string> known);

}  // namespace gapfarm
