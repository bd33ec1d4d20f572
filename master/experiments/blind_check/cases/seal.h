// Seals: truths that are fixed and published before anybody answers, and that nobody can read
// until they are opened.
//
// A seal is BLAKE2b-256(salt || truth) with a random salt of 16 bytes: it fixes the truth, and the
// salt keeps it from being guessed.  Until they are opened, truths and salts lie in one box
// (XSalsa20-Poly1305, libsodium's secretbox) whose key only the process that made it holds.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

struct SealedTruth {
  std::string id;
  std::string salt;   // 32 hex digits
  std::string truth;  // text of the truth, byte for byte
};

std::string random_salt();
// 64 hex digits.
std::string seal_of(std::string_view salt, std::string_view truth);

// seals.txt: "ID SEAL" a line.
std::string format_seals(const std::vector<SealedTruth>& truths);

// OK when every truth has its seal in the text of a seals.txt, and every seal its truth; the error
// names the first that does not.
Status verify_seals(const std::vector<SealedTruth>& truths, std::string_view seals,
                    const std::string& file);

// A secret key, wiped from memory when it goes.
class TruthKey {
 public:
  static TruthKey random();
  // Of the text of a key file; the error names the file.
  static Result<TruthKey> parse(std::string_view text, const std::string& file);
  ~TruthKey();
  TruthKey(const TruthKey&) = default;
  TruthKey& operator=(const TruthKey&) = default;
  TruthKey(TruthKey&&) = default;
  TruthKey& operator=(TruthKey&&) = default;

  std::string text() const;  // 64 hex digits and a line end

  std::string close_box(const std::vector<SealedTruth>& truths) const;
  // Error: another key's box, or a box that was changed.
  Result<std::vector<SealedTruth>> open_box(std::string_view box, const std::string& file) const;

 private:
  TruthKey() = default;
  std::vector<unsigned char> bytes_;
};

// A file that only its owner can read, replaced whole.
Status write_private_file(const std::string& path, std::string_view bytes);

// While it lives, no other process of the user can read this one's memory through /proc or ptrace,
// and it leaves no core.
class PrivateMemory {
 public:
  PrivateMemory();
  ~PrivateMemory();
  PrivateMemory& operator=(PrivateMemory&&) = delete;

 private:
  int before_;
};

}  // namespace gapfarm
