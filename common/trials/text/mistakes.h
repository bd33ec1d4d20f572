// All that is wrong with a log, reported at once, and the rows that may be omitted for it.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

class Mistakes {
 public:
  // `skip_rows`: rows with mistakes are omitted, and the mistakes become notes.
  explicit Mistakes(bool skip_rows) : skip_rows_(skip_rows) {}

  // Of one row.
  void add_row(const std::vector<Error>& errors);
  // Of a whole file: nothing can be had from it.
  void add_file(const Error& error);
  // Every row of a file has mistakes.
  void add_no_row(const std::string& file);

  // Rows that are omitted, so far.
  std::size_t omitted() const { return skip_rows_ ? rows_ : 0; }

  // OK when there are none, or rows alone that are omitted.  Else all of them, a line each kind
  // with the places of all its rows; of many the first and their number.
  Status status() const;
  // What was held out and why.  REQUIRES: status() is OK.
  std::vector<std::string> notes() const;

 private:
  // Alike but for their places.
  struct Kind {
    std::string first;               // with its place
    std::vector<std::string> lines;  // of the others
    std::size_t more = 0;            // whose lines are not kept
  };

  static std::string text(const Kind& kind);

  bool skip_rows_;
  std::size_t count_ = 0;
  std::size_t rows_ = 0;
  std::size_t unshown_ = 0;
  std::vector<std::string> files_;  // what was reported of them
  std::vector<Kind> kinds_;
  std::map<std::string, std::size_t> kind_of_;  // by file and what was found there
};

}  // namespace gapfarm
