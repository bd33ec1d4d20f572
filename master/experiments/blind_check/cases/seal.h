// Seals: truths that are fixed and published before anybody answers, and that nobody can read
// until they are opened.
//
// A seal is BLAKE2b-256(salt || truth) with a random salt of 16 bytes: it fixes the truth, and the
// salt keeps it from being guessed.  Until they are opened, truths and salts stay in the memory of
// the process that made them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/effects/catalogue.h"

namespace gapfarm {

// Of any scenario's catalogue: what bears one name is one effect.  Null: none has it.
const Effect* catalogue_entry(const std::string& name);

struct TrueEffect {
  std::string name;
  // In the catalogue's units; choices by index.
  std::map<std::string, double> parameters;
  // Mean squared shift of the end poses that it causes, in units of the predictive covariance
  // (docs/diagnosis.md): 1 = nothing.
  double size = 1;
};

enum class CaseKind { kNull, kSingle, kPair, kOutside };
const char* case_kind_name(CaseKind kind);  // "null", "single", "pair", "outside"

struct Truth {
  std::string id;  // "case001"
  CaseKind kind = CaseKind::kNull;
  std::string level;  // of the sizes: "clear", "subtle"; may be empty
  std::vector<TrueEffect> effects;
  std::string excluded;  // effect that the diagnosis does without; empty: none
  // Base parameters that are not the config's, by key of the parameter table.
  std::map<std::string, double> robot;
  std::uint64_t seed = 0;  // of plan and noise
};

// What a diagnosis should say: "none", "effect" or "unknown".
std::string answer_of(const Truth& truth);

// The layout of truth/caseNN.json: effects, size, level, robot, answer; with case, kind, left_out
// and seed beside them.  Every number reads back as the same bits.
std::string format_truth(const Truth& truth);

// Also reads truths that others wrote, which hold effects and answer at least; `id` is kept when
// the file has no case.  Errors name the file and the field.
Result<Truth> parse_truth(const std::string& text, const std::string& file, const std::string& id);

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

// A file of truths and salts, as a stopped check leaves it.
std::string format_sealed(const std::vector<SealedTruth>& truths);
Result<std::vector<SealedTruth>> parse_sealed(const std::string& text, const std::string& file);

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
