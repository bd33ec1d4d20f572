#include "common/trials/text/mistakes.h"

#include <string_view>
#include <utility>

namespace gapfarm {
namespace {

constexpr std::size_t kMostKinds = 20;      // a screen of them
constexpr std::size_t kMostLines = 10;      // of a kind
constexpr std::size_t kMostSkipped = 1000;  // a record of what is missing, so nearly all

std::string counted(std::size_t n, const char* thing) {
  return std::to_string(n) + " " + thing + (n == 1 ? "" : "s");
}

// "file:line:column" and ": found ..." of a sentence of text_error().
std::pair<std::string_view, std::string_view> cut_place(std::string_view sentence) {
  const std::size_t at = sentence.find(": found ");
  if (at == sentence.npos) return {{}, sentence};
  return {sentence.substr(0, at), sentence.substr(at)};
}

// "file" and "line" of "file:line:column".
std::pair<std::string_view, std::string_view> cut_line(std::string_view place) {
  const std::size_t column = place.rfind(':');
  if (column == place.npos || column == 0) return {};
  const std::size_t line = place.rfind(':', column - 1);
  if (line == place.npos) return {};
  return {place.substr(0, line), place.substr(line + 1, column - line - 1)};
}

}  // namespace

void Mistakes::add_row(const std::vector<Error>& errors) {
  if (errors.empty()) return;
  ++rows_;
  for (const Error& error : errors) {
    ++count_;
    const auto [place, what] = cut_place(error.message);
    const auto [file, line] = cut_line(place);
    const auto [known, is_new] =
        kind_of_.emplace(std::string(file) + std::string(what), kinds_.size());
    if (is_new && kinds_.size() < (skip_rows_ ? kMostSkipped : kMostKinds)) {
      kinds_.push_back({error.message, {}, 0});
    } else if (is_new) {
      kind_of_.erase(known);
      ++unshown_;
    } else if (Kind& kind = kinds_[known->second];
               kind.lines.size() < (skip_rows_ ? kMostSkipped : kMostLines)) {
      kind.lines.emplace_back(line);
    } else {
      ++kind.more;
    }
    // Of a row that is omitted one reason is enough.
    if (skip_rows_) break;
  }
}

void Mistakes::add_file(const Error& error) {
  ++count_;
  files_.push_back(error.message);
}

void Mistakes::add_no_row(const std::string& file) {
  if (skip_rows_) add_file(Error{file + ": there is no row without a mistake"});
}

std::string Mistakes::text(const Kind& kind) {
  std::string text = kind.first;
  for (std::size_t i = 0; i < kind.lines.size(); ++i) {
    text += (i > 0                    ? ", "
             : kind.lines.size() == 1 ? "; also in line "
                                      : "; also in lines ") +
            kind.lines[i];
  }
  if (kind.more > 0) text += " and " + std::to_string(kind.more) + " more";
  return text;
}

Status Mistakes::status() const {
  if (count_ == 0 || (skip_rows_ && files_.empty())) return {};
  std::string all;
  for (const std::string& sentence : files_) all += (all.empty() ? "" : "\n") + sentence;
  for (std::size_t i = 0; i < kinds_.size() && i < kMostKinds; ++i) {
    all += (all.empty() ? "" : "\n") + text(kinds_[i]);
  }
  if (unshown_ > 0) all += "\nand " + counted(unshown_, "more mistake");
  if (rows_ > 0 && !skip_rows_) {
    all += "\n" + counted(count_, "mistake") + " in " + counted(rows_, "row") + ": mend " +
           (count_ == 1 ? "it" : "them") + ", or leave such rows out with --skip-invalid";
  }
  return Error{all};
}

std::vector<std::string> Mistakes::notes() const {
  std::vector<std::string> notes;
  if (rows_ == 0) return notes;
  for (const Kind& kind : kinds_) notes.push_back("omitted: " + text(kind));
  notes.push_back("omitted " + counted(rows_, "row") + " with mistakes in all");
  return notes;
}

}  // namespace gapfarm
