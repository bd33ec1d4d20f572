// What the page of a run shows.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/json/json.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/report/html.h"
#include "master/store/run_reader.h"

namespace gapfarm {

// What of a run is shown beside the last generation's best.
struct RunQuestion {
  std::filesystem::path run;
  std::optional<std::uint64_t> genome;      // to look up
  std::optional<std::uint64_t> generation;  // whose best are listed; none: the last
};

// One generation's fitness; none where no individual ended well.
struct RunGeneration {
  std::uint64_t generation = 0;
  std::optional<double> best, median, worst;
  std::uint64_t evaluations = 0;  // since the run began
  double wall_s = 0;              // same
};

// How well something predicts trials.
struct ScoreRow {
  std::string name;             // "the config's own values", "after stage 1", "the best"
  std::optional<double> score;  // in the run's fitness, or nats a trial; none: it did not end well
};

// What is worked out once, when evolution ends, and kept in the run store.
struct RunOutcome {
  std::vector<DiagnosedTrial> trials;  // "tuned" is before, "final" after evolution
  std::vector<ScoreRow> validation;    // on trials held out, in the run's fitness
  std::vector<ScoreRow> baselines;     // without a simulation, nats a trial
};
std::string to_json(const RunOutcome& outcome);
// Errors: not what to_json() wrote.
Result<RunOutcome> parse_run_outcome(const std::string& json);

// Where a gene's population was, generation by generation.
struct GeneDensity {
  std::string key, unit;
  std::vector<double> edges;                  // of the bins, in the parameter's unit, ascending
  std::vector<std::uint64_t> generations;     // those that are drawn, ascending
  std::vector<std::vector<unsigned>> counts;  // [generation][bin]
  std::vector<double> best;                   // of those generations
};

struct RunWorker : WorkerStatus {
  std::string failure;  // the last of this name, with its time; empty: none
};

using RunGenome = RunReader::Member;

// The best of the last generation over all genes, best first.
struct RunElite {
  struct Axis {
    std::string key, unit;
    std::string lower, upper;  // ends of the range, for people
  };
  struct Line {
    std::uint64_t birth_id = 0;
    std::optional<double> fitness;
    std::vector<double> shares;       // of the ranges as they are searched, [0, 1]
    std::vector<std::string> values;  // for people
  };
  std::vector<Axis> axes;
  std::vector<Line> lines;
};

// What the evaluations say of the genes.
struct RunSample {
  struct GeneShare {
    std::string key, unit;
    double lower = 0, upper = 0;
    bool log = false;                // searched by its logarithm
    std::vector<double> importance;  // one each of `outputs`, [0, 1]; none of too few evaluations
  };
  std::vector<std::string> outputs;  // the fitness, or several objectives
  std::vector<GeneShare> genes;
  std::vector<StoredIndividual> evaluated;  // a thousand of them at most, each with a fitness
};

// Which workers were there, all masters of the run together.  Empty where the store does not show.
struct RunTimeline {
  struct Count {
    double unix_s = 0;
    unsigned workers = 0;  // from then on
  };
  struct Mark {
    double unix_s = 0;
    unsigned workers = 0;
    std::string kind;  // "joined", "left", "failed", "master"
    std::string text;  // a sentence with its time
  };
  struct Span {
    std::string name, host;
    double from_unix_s = 0, to_unix_s = 0;
    std::string end;  // how it ended, when that was a failure
  };
  std::vector<Count> counts;
  std::vector<Mark> marks;  // a few hundred at most, the latest
  std::vector<Span> spans;  // of every worker, when these are few; else empty
  double end_unix_s = 0;    // the last that was heard of the run
  double worker_s = 0;      // that workers were there, of all together
};

// The farm as its master last reported it.
struct RunFarm {
  std::string state;                                       // "running"
  std::string message;                                     // what it waits for, or how it ended
  std::vector<std::pair<std::string, std::string>> facts;  // "rate": "38.1 evaluations/s"
  // What it coped with, counted over all masters: "retries": "3".
  std::vector<std::pair<std::string, std::string>> tally;
  std::vector<RunWorker> workers;
  RunTimeline timeline;
  std::vector<std::string> failures;   // of workers, latest first
  std::vector<RunGenome> given_up;     // whose tasks were, latest first
  std::vector<std::string> incidents;  // latest first
  std::vector<std::string> log;        // the last lines of log.txt
};

struct RunReport {
  std::string name;      // of the folder
  std::string headline;  // one line
  std::string action;    // one line
  std::string fitness;   // "log_score"
  std::string unit;      // "nats/trial"; "-" without one
  bool higher_is_better = true;
  std::vector<RunGeneration> generations;
  std::vector<ParameterRow> parameters;  // interval: the last generation's middle nine tenths
  std::optional<RunOutcome> outcome;
  std::string without_outcome;  // why there is none
  bool objective = false;       // there are values and a number, and no trials
  bool pieces = false;          // the trials are pushes of pieces
  std::vector<std::string> operators;
  // [probability_generations][operators]: of some generations, in order.
  std::vector<std::vector<double>> probabilities;
  std::vector<std::uint64_t> probability_generations;
  std::vector<GeneDensity> densities;
  std::vector<RunGenome> genomes;      // best first, a few
  std::uint64_t genomes_of = 0;        // the generation that they are of
  std::optional<RunGenome> looked_up;  // the one that was asked for
  // Of that one each searched parameter and its value with unit.
  std::vector<std::pair<std::string, std::string>> looked_up_values;
  std::string without_looked_up;  // why there is none, when one was asked for
  RunElite elite;
  RunFront front;  // not empty: `fitness` is the first of its objectives
  RunSample sample;
  RunFarm farm;
  std::size_t trials = 0;    // of the log
  bool windows = false;      // trials are windows of runs
  std::size_t held_out = 0;  // trials of [validation] that a server can play
  bool served = false;       // by `gapfarm serve`: the page looks again while it is open
  std::vector<std::pair<std::string, std::string>> provenance;

  // What a generation's first individual is called.
  std::string best_label() const { return front.objectives.empty() ? "best" : "knee"; }
};

// About `most` of `points`, in order: the first, the last, and of each stretch between them the
// least and the greatest by `value`.
template <class Point, class Value>
std::vector<Point> decimated(const std::vector<Point>& points, std::size_t most, Value value) {
  if (points.size() <= most) return points;
  const std::size_t stretches = most / 2 - 1;
  std::vector<Point> kept = {points.front()};
  for (std::size_t k = 0; k < stretches; ++k) {
    std::size_t least = 1 + k * (points.size() - 2) / stretches, most_at = least;
    const std::size_t end = 1 + (k + 1) * (points.size() - 2) / stretches;
    for (std::size_t i = least; i < end; ++i) {
      if (value(points[i]) < value(points[least])) least = i;
      if (value(points[i]) > value(points[most_at])) most_at = i;
    }
    kept.push_back(points[std::min(least, most_at)]);
    if (least != most_at) kept.push_back(points[std::max(least, most_at)]);
  }
  kept.push_back(points.back());
  return kept;
}

// The whole file, UTF-8, as report_html() makes one.
std::string run_html(const RunReport& report);

// Fitness by generation, as SVG: best over the band from best to worst, and median.  The scale
// follows the best and the bulk of the medians; what is worse is cut off at the frame.
std::string fitness_chart(const RunReport& report);

// All its numbers that are not whole with no more digits than plots can show.
Json rounded(Json json, int digits = kPlotDigits);

// `none`: a sentence where there are none.
std::string worker_table(const std::vector<RunWorker>& workers, const std::string& none);

// "running, 38.1 evaluations/s, about 3 min left", in a line of its own.
std::string state_line(const RunFarm& farm);
std::string operators_section(const RunReport& report);
std::string densities_section(const RunReport& report);
std::string elite_section(const RunReport& report);
std::string genomes_section(const RunReport& report);
std::string farm_section(const RunFarm& farm);

// At most 2,000.
Json generations_json(const RunReport& report);
Json operators_json(const RunReport& report);
Json densities_json(const RunReport& report);
Json elite_json(const RunReport& report);
Json timeline_json(const RunFarm& farm);

}  // namespace gapfarm
