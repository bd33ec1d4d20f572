// THE parameter table of a scenario.  Config keys, genes, wire format, documentation and report
// labels all derive from its rows; effect parameters are rows of it too ("battery_sag.rate").
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/effects/catalogue.h"

namespace gapfarm {

// One value a row.  Booleans are 0 or 1, choices are indices, integers are whole.
using ParameterValues = std::vector<double>;

class ParameterTable {
 public:
  ParameterTable(std::vector<Parameter> base, std::span<const Effect> effects);

  std::size_t size() const { return rows_.size(); }
  const Parameter& operator[](std::size_t row) const { return rows_[row]; }
  const std::vector<Parameter>& rows() const { return rows_; }
  std::span<const Effect> effects() const { return effects_; }

  std::optional<std::size_t> find(std::string_view key) const;
  // REQUIRES: the key exists.
  std::size_t row(std::string_view key) const;
  // First row of effect `e`'s parameters; they follow one another in the catalogue's order.
  std::size_t effect_row(std::size_t e) const { return effect_rows_[e]; }

  ParameterValues nominal() const;
  // Every effect that strikes by chance made neutral.
  void without_chance(ParameterValues* values) const;
  // Whether effect `e` does nothing at `values`.
  bool is_neutral(std::size_t e, const ParameterValues& values) const;

  // OK when `value` is one the row accepts; the error names key, value, unit and bounds.
  Status check(std::size_t row, double value) const;
  // For people, to four digits: "0.35 kg", "sphere", "true".
  std::string format(std::size_t row, double value) const;
  // The same without a unit and in full, as `--set` and configs read it.
  std::string text_of(std::size_t row, double value) const;

 private:
  std::vector<Parameter> rows_;
  std::span<const Effect> effects_;
  std::vector<std::size_t> effect_rows_;
};

// Base rows of scenario `srv1`, in table order; `values[row_of(Srv1::kMass)]` is the mass.
enum class Srv1 : std::size_t {
#define ROW(name, row) name,
#define SETTING(name, member, row) name,
#include "common/parameters/srv1_rows.inc"
  kCount
};
constexpr std::size_t row_of(Srv1 p) { return static_cast<std::size_t>(p); }

// The scenarios that have a table, in a fixed order; the first is the default.
std::span<const std::string> scenario_names();
// The table of a scenario; an error names the known scenarios.
Result<const ParameterTable*> parameter_table(std::string_view scenario);
// Of the SRV-1 (common/parameters/tracked.h).
const ParameterTable& srv1_table();

struct Gene {
  std::size_t row = 0;  // of the parameter table
  double lower = 0;     // the searched range, within the row's bounds
  double upper = 1;
  ParameterScale scale = ParameterScale::kLinear;

  bool operator==(const Gene&) const = default;
};

using Genome = std::vector<double>;  // one value in [0, 1] a gene

// The parameter value of a gene at `g` in [0, 1].  Reals map linearly or log-linearly; integers and
// choices split [0, 1] into equal shares, one a value; booleans split at 1/2.
double decode_gene(const ParameterTable& table, const Gene& gene, double g);

// The middle of the gene values that decode to `value`, clamped to [0, 1].
double encode_gene(const ParameterTable& table, const Gene& gene, double value);

// Replaces the genes' rows in `values`.  REQUIRES: one value a gene.
void decode(const ParameterTable& table, const std::vector<Gene>& genes, const Genome& genome,
            ParameterValues& values);

// In table order; `values[row_of(Push::kGroundFriction)]` is the friction of piece and table.
enum class Push : std::size_t {
#define ROW(name, row) name,
#define SETTING(name, member, row) name,
#include "common/parameters/push_rows.inc"
  kCount
};
constexpr std::size_t row_of(Push p) { return static_cast<std::size_t>(p); }
// Pieces that can have a shape factor or a pressure of their own.
inline constexpr std::size_t kOwnShapeFactors = 8;

const ParameterTable& push_table();

// Whether `model` carries pieces on their whole face, so that `pressure` takes the place of
// `shape_factor`.
bool rests_on_its_face(const ParameterValues& values);

// Base rows in table order.  Lengths in m, as everywhere; the court is 20 m wide in each direction,
// like the one of the published paths.
enum class Racquetball : std::size_t {
#define ROW(name, row) name,
#define SETTING(name, member, row) name,
#include "common/parameters/racquetball_rows.inc"
  kCount
};
constexpr std::size_t row_of(Racquetball p) { return static_cast<std::size_t>(p); }

const ParameterTable& racquetball_table();

}  // namespace gapfarm
