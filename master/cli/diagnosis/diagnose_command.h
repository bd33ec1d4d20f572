// gapfarm diagnose: what its parts share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/recordings/run.h"
#include "master/command/inputs.h"
#include "master/command/outputs.h"
#include "master/command/page_along.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

inline constexpr const char* kDiagnosisFile = "diagnosis.json";

struct DiagnoseCommand : LongOptions {
  std::string config;
  TrialOptions trials;
  std::string model;
  std::vector<std::string> reference;  // of ground robots: what changed since
  std::optional<RunLog> reference_log;
  std::vector<std::string> exclude;
  std::optional<std::uint64_t> seed;
  PageOption page;
};

void add_diagnosis_provenance(const Config& config, const DiagnoseCommand& command,
                              Diagnosis* diagnosis);

// Leaves `files`, report.html and diagnosis.json, and shows what was found.  `left`: of the files,
// for people.
Status leave_diagnosis(const DiagnoseCommand& command, const Diagnosis& diagnosis,
                       Outputs::NamedTexts files, const std::string& left, Console& console);

// Reads the log that --reference names, if it does.  Errors: the scenario is not of ground robots;
// a model whose log is gone.
Status read_reference(DiagnoseCommand* command, const Config& config, Console& console);
std::string log_hash(const RunLog& log);

// A ground robot: its file and its runs, by its kinematics, and nothing is simulated; or runs that
// a program follows, which is asked for every motion.  `searched`: the config's genes; `stamp`: the
// text of question.json.
Result<int> run_diagnose_runs(DiagnoseCommand& command, const Config& config,
                              const std::vector<Gene>& searched, const std::string& stamp,
                              CliContext& context);

}  // namespace gapfarm
