// The wire decoder and the checks of a problem: no crash, what is accepted is sound and survives
// another trip.
#include "common/net/envelope.h"
#include "common/problem/problem.h"
#include "tests/fuzz/fuzz_target.h"

namespace gapfarm {
namespace {

void check_problem(const std::string& text) {
  v1::Problem message;
  if (!message.ParseFromString(text)) return;
  const auto problem = from_proto(message);
  if (!problem.ok()) {
    promise(!problem.error().message.empty(), "errors say something");
    return;
  }
  const ParameterTable& table = problem->table();
  promise(problem->values.size() == table.size(), "a value a row");
  const Genome middle(problem->genes.size(), 0.5);
  const ParameterValues values = problem->values_of(middle);
  for (std::size_t row = 0; row < table.size(); ++row) {
    promise(table.check(row, values[row]).ok(), "values are within bounds");
  }
  for (const Trial& trial : problem->log.trials) problem->command(trial.command);
  const std::string bytes = serialise(to_proto(*problem));
  v1::Problem again;
  promise(again.ParseFromString(bytes), "problems parse as they were written");
  const auto same = from_proto(again);
  promise(same.ok() && serialise(to_proto(*same)) == bytes, "problems survive another trip");
}

void check_envelope(std::string_view bytes) {
  v1::Envelope envelope;
  if (decode(bytes, &envelope) != DecodeStatus::kOk) return;
  promise(envelope.body_case() != v1::Envelope::BODY_NOT_SET, "envelopes have a body");
  const std::string written = encode(&envelope);
  v1::Envelope again;
  promise(decode(written, &again) == DecodeStatus::kOk, "envelopes survive another trip");
  if (envelope.has_problem_reply()) check_problem(envelope.problem_reply().problem());
}

}  // namespace
}  // namespace gapfarm

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  gapfarm::check_envelope(gapfarm::bytes_of(data, size));
  return 0;
}
