// The parameter tables of a user's program.  Scenario `external`: its own rows, the noise of drives
// and readings, and the effects that can be applied around what it takes in; `external_runs`: what
// can be applied around runs in their place.  Scenario `objective`: its own rows.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/effects/catalogue.h"
#include "common/parameters/table.h"

namespace gapfarm {

// What a request may hold beside the two sides' speeds and the duration.
enum ExternalInput : unsigned {
  kExternalLag = 1u << 0,         // time constant of each side's motor
  kExternalDeadTravel = 1u << 1,  // travel swallowed before a side moves
  kExternalFloor = 1u << 2,       // tilt, nap, rolling resistance, a patch
  kExternalPath = 1u << 3,        // poses on the way are answered
};

struct ExternalInputWord {
  const char* word;
  ExternalInput input;
};
inline constexpr ExternalInputWord kExternalInputNames[] = {{"lag", kExternalLag},
                                                            {"dead_travel", kExternalDeadTravel},
                                                            {"floor", kExternalFloor},
                                                            {"path", kExternalPath}};

// One that a parameter depends on, and the values at which the parameter is there.
struct ExternalCondition {
  std::size_t row = 0;  // of an earlier parameter
  std::vector<double> values;
};

// What a program says of itself.
struct ExternalDeclaration {
  std::string name;
  std::vector<Parameter> parameters;
  unsigned inputs = 0;  // of ExternalInput
  // One list a parameter, all of which must hold for it to be there; or none at all.
  std::vector<std::vector<ExternalCondition>> when;
  bool objective = false;  // answers a number and moves nothing
  // Of the commands of a run, as commands.csv calls them; none: it drives from rest to rest.
  std::vector<std::string> channels = {};

  // Which of the parameters are there at `values`, of which there is one a parameter at least.
  std::vector<bool> present(const ParameterValues& values) const;
};

// Rows of a program's channels: what a command becomes before the program gets it.
inline constexpr const char* kChannelGain = ".gain";
inline constexpr const char* kChannelOffset = ".offset";

// How it is started.
struct ExternalCommand {
  std::vector<std::string> argv;  // program and arguments, found by PATH
  std::string folder;             // where it is started
  double answer_limit_s = 60;     // for one answer

  bool operator==(const ExternalCommand&) const = default;
};

class ExternalTable {
 public:
  // REQUIRES: check_declaration() is OK.
  explicit ExternalTable(ExternalDeclaration declaration);
  ExternalTable& operator=(ExternalTable&&) = delete;

  const ExternalDeclaration& declaration() const { return declaration_; }
  const ParameterTable& table() const { return *table_; }
  // The first rows are the declaration's, in its order; but of an objective and of a program with
  // channels the noise of scenario `srv1` follows, in that table's order.
  std::size_t first_noise_row() const { return declaration_.parameters.size(); }

 private:
  ExternalDeclaration declaration_;
  std::vector<Effect> effects_;
  std::unique_ptr<ParameterTable> table_;
};

// Errors name the parameter: no key, a key that is taken or no TOML bare key, bounds that are
// empty, not finite or do not hold the nominal value, a log scale that reaches 0, an integer with
// bounds that are not whole or a log scale, choices that are empty, equal or no plain text; or the
// channel: no name, or a name twice.
Status check_declaration(const ExternalDeclaration& declaration);

// What problems without a program have: noise, and nothing that moves.
const ParameterTable& external_table();
const ParameterTable& external_runs_table();

}  // namespace gapfarm
