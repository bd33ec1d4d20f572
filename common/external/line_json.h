// Lines of JSON from a program of the user's.  Internal to common/external.
#pragma once

#include <string>

#include "common/base/result.h"
#include "common/json/json.h"

namespace gapfarm::line_json {

// The beginning of what a program printed, quoted, with control bytes as '?' and what is not
// UTF-8 as U+FFFD.
std::string shown(const std::string& text);

// `what`, and the line as shown().
Error wrong(const std::string& what, const std::string& line);

// Python's json and others print what JSON does not have.  `not_a_number`: where to put the first
// such word, with null in its place; null: that is an error.
Result<Json> read_object(const std::string& line, const std::string& what,
                         std::string* not_a_number = nullptr);

// A text without what would break a line; empty: there is none.
std::string word_of(const Json& json, const char* key);

}  // namespace gapfarm::line_json
