#include "common/trials/mark.h"

#include <algorithm>
#include <filesystem>

#include "common/base/hash.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

constexpr std::string_view kWord = "# log:";
constexpr std::size_t kHashDigits = 32;

std::string name_of(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

bool is_hash(std::string_view word) {
  return word.size() == kHashDigits && word.find_first_not_of("0123456789abcdef") == word.npos;
}

LogMark mark_of(std::string_view text) {
  text = trimmed(text);
  const std::size_t blank = text.find_last_of(" \t");
  const std::string_view last = blank == text.npos ? text : text.substr(blank + 1);
  if (!is_hash(last)) return {std::string(text), {}};
  return {std::string(trimmed(text.substr(0, text.size() - last.size()))), std::string(last)};
}

}  // namespace

std::string format_mark(const std::string& log_path, std::string_view log_text) {
  return std::string(kWord) + " " + name_of(log_path) + " " + content_hash(log_text) + "\n";
}

std::vector<LogMark> log_marks(std::string_view text) {
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  std::vector<LogMark> marks;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (!is_comment(line)) break;
    if (line.substr(0, kWord.size()) == kWord) marks.push_back(mark_of(line.substr(kWord.size())));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return marks;
}

Belonging belonging(const std::vector<LogMark>& marks, const std::string& log_path,
                    std::string_view log_text) {
  const std::string name = name_of(log_path);
  const std::string hash = content_hash(log_text);
  bool named = false;
  for (const LogMark& mark : marks) {
    const bool same_name = mark.file == name;
    // A log that was moved or renamed is still the one.
    if (mark.hash.empty() ? same_name : mark.hash == hash) return Belonging::kYes;
    named = named || same_name;
  }
  return named ? Belonging::kStale : Belonging::kNo;
}

}  // namespace gapfarm
