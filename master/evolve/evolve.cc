#include "master/evolve/evolve.h"

#include "master/evolve/generation_record.h"

namespace gapfarm {

Result<EvolveSummary> evolve(Optimiser& optimiser, EvaluationBackend& backend, GenerationSink& sink,
                             const EvolveClock& clock, const EvolveOptions& options,
                             const std::function<bool()>& stop_requested) {
  const double began_s = clock.now_s();
  const auto spent_s = [&] { return options.spent_s + clock.now_s() - began_s; };
  const auto requested = [&] { return stop_requested && stop_requested(); };

  for (;;) {
    auto stop = reason_to_stop(optimiser, options, spent_s(), requested());
    if (stop) return summarise(optimiser, *stop, spent_s());

    const double generation_began_s = clock.now_s();
    const std::vector<Candidate> candidates = optimiser.ask();
    const Result<std::vector<Score>> scores = backend.evaluate(candidates);
    if (!scores && requested()) {
      stop = reason_to_stop(optimiser, options, spent_s(), true);
      return summarise(optimiser, *stop, spent_s());
    }
    if (!scores) return scores.error();
    if (scores->size() != candidates.size()) return wrong_count(candidates.size(), scores->size());
    optimiser.tell(*scores);

    GenerationRecord record = record_generation(optimiser);
    record.wall_s = clock.now_s() - generation_began_s;
    if (const Status committed = sink.commit(record); !committed) return committed.error();
  }
}

}  // namespace gapfarm
