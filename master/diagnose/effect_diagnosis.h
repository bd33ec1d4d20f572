// All that a diagnosis knows of one effect, as a row (effects/).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/math/laws.h"
#include "common/parameters/table.h"
#include "master/diagnose/fit/regression.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/study.h"
#include "master/infer/compete.h"

namespace gapfarm {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // of a radian

struct ShownParameter {
  const char* key;
  double factor;
  const char* unit;
};

struct EffectPhrases {
  // %1, %2, ...: the parameters' values with their intervals; %a: a seam's axis.  Null: none.
  const char* sentence = nullptr;
  std::vector<ShownParameter> parameters = {};
  // On one line, without intervals, where %1 is a size.  Null: no line of its own.
  const char* remedy = nullptr;
  const char* brief = nullptr;     // null: the sentence
  const char* opposite = nullptr;  // where the first value is negative; null: the same
};

struct SpreadRow;

// One of the effect's parameters, moved by a step from where it does nothing.
struct ProbedStep {
  const char* key;
  double size;
  bool both_ways;
};

// A strength and a direction, whose first two columns belong to its cosine and sine.
struct Polar {
  const char* strength;
  const char* direction;
  double symmetry;  // looks the same after this share of a turn
  bool ratio;       // the strength is the logarithm of a ratio
};

struct WorldPlace {
  const char* key;
  int axis;  // 0: x, 1: y, -1: what the effect's `axis` says
};

// Where a fit of the effect begins: data with everything else explained, and what the columns of
// its signature take of them.
struct EffectStart {
  const Study& study;
  const Regression& others;
  const Signature& signature;
  const Eigen::VectorXd& coefficients;
};

// A parameter that a search moves, and the size of it that a careless laboratory has: of the
// logarithm where only positive values have a meaning.
struct SearchedSize {
  const char* key;
  double size;
  bool logarithm = false;
  double model_error = 0;  // in place of the effect's, where above 0
};

struct EffectDiagnosis {
  const char* effect;

  // What is moved where base and effect are searched together; with `polar`, its strength alone.
  std::vector<SearchedSize> searched = {};
  // The effect that a part of it is: named instead unless the whole gains as much more as a name
  // asks for.
  const char* part = nullptr;
  // Where such a search begins, beside what the sizes say; null: nowhere else.  Effects with a
  // place do nothing at their neutral value, and no slope leads away from it.
  std::vector<infer::Start> (*proposals)(const Study& study) = nullptr;

  // Its mark: by steps of parameters, by the strength and direction that are searched, or by probes
  // of its own; without any it is looked for in another way.
  std::vector<ProbedStep> steps = {};
  std::vector<Probe> (*probes)(const Study& study) = nullptr;
  // Without a probe: marks at places, which the log alone shows.
  std::vector<Signature> (*marks)(const Study& study) = nullptr;
  // One level and one duration show nothing of it that another full speed would not do.
  bool changes_reach = false;

  // A camera that sees one place otherwise than another: not offered where one linear map of all
  // positions explains as much.
  bool bends_view = false;

  // Alternatives, whatever the log.
  std::vector<const char*> aliases = {};

  // Where a fit begins.  Neither: the coefficients are what its parameters are above neutral.
  std::optional<Polar> polar = {};
  void (*start)(const EffectStart& at, std::map<std::string, double>* values) = nullptr;

  // What its size differs by between simulations that share the effect but not the contact
  // (docs/diagnosis.md): a factor of 1 + this is one standard deviation; of its direction, rad.
  double model_error = 0;
  double direction_error_rad = 0;
  // What was searched rather than fitted may be a neighbour of the best: standard deviation for a
  // gain in nats, and of what the readings leave open whatever it gained; in the parameter's unit.
  double (*search_error)(const Parameter& p, double value, double gain) = nullptr;
  double (*ambiguity)(const Study& study, const Parameter& p, const Overrides& at) = nullptr;

  // Places in the world, and the keys that state where a second one would be.
  std::vector<WorldPlace> places = {};
  std::vector<const char*> identified_by = {};
  // Of an effect of which there may be two: whether two marks of it are of two such things.
  bool (*are_two)(const Signature& a, const Signature& b) = nullptr;
  // The key of a strength that may end on its bound: beyond it the motion hardly changes any more.
  const char* saturates = nullptr;
  // Whether it makes single trials outliers, as slips would.
  bool (*contaminates)(const Signature& chosen, const ResidualTrial& trial) = nullptr;

  EffectPhrases phrases = {};
  const SpreadRow* spread = nullptr;  // of an effect that makes some trials outliers
  // Of what no mean shows: how screening says that it was seen, or not.
  const char* found = nullptr;
  const char* missing = nullptr;
};

class EffectDiagnoses {
 public:
  explicit EffectDiagnoses(std::vector<const EffectDiagnosis*> rows) : rows_(std::move(rows)) {}
  auto begin() const { return rows_.begin(); }
  auto end() const { return rows_.end(); }
  // Null where the effect has no row.
  const EffectDiagnosis* find(std::string_view effect) const;
  std::size_t place_in_catalogue(std::string_view effect) const;  // size of it where it has none
  // A row of nothing where it has none.
  const EffectDiagnosis& row(std::string_view effect) const;

 private:
  std::vector<const EffectDiagnosis*> rows_;
};

// Of robots that drive on two sides; of pieces that are pushed.
const EffectDiagnoses& drive_effect_diagnoses();
const EffectDiagnoses& push_effect_diagnoses();
// Of any scenario, since what bears one name is one effect; a row of nothing where there is none.
const EffectDiagnosis& effect_diagnosis(std::string_view effect);

// The place that a parameter of an effect is; null: none.
const WorldPlace* place_of(const EffectDiagnoses& effects, const Parameter& p);

// The row of a second one of a kind, whose marks are the first one's, which the search offers
// again.
EffectDiagnosis second_of_a_kind(EffectDiagnosis first, const char* effect, const char* sentence);

void start_polar(const Polar& polar, const EffectStart& at, std::map<std::string, double>* values);

// How far a 90 % interval reaches from a value, in its unit.
struct IntervalSides {
  double below = 0, above = 0;
};
// Of table row `row`, with what the fit (standard deviation `fitted`) leaves open and what its
// linearisation cannot see: that another simulation of the same effect gives it another size, and
// that places are searched.  `at` holds the effect's values; the effect gained `gain` nats.
IntervalSides interval_sides(const Study& study, const ParameterTable& table, std::size_t row,
                             const Overrides& at, double gain, double fitted);

}  // namespace gapfarm
