// Cost functions with known minima for the tests of the evolution.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "master/evolve/individual.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {

// `made` in the state of another optimiser.
inline Result<std::unique_ptr<Optimiser>> restored(Result<std::unique_ptr<Optimiser>> made,
                                                   std::string_view state) {
  if (!made) return made;
  if (const Status status = (*made)->restore(state); !status) return status.error();
  return made;
}

inline Result<std::unique_ptr<Optimiser>> restore_optimiser(const OptimiserSetup& setup,
                                                            std::string_view state) {
  return restored(make_optimiser(setup), state);
}

struct Toy {
  std::vector<Parameter> rows;
  std::function<double(const ParameterValues&)> cost;

  ParameterTable table() const { return ParameterTable(rows, {}); }
  std::vector<Gene> genes() const {
    std::vector<Gene> all;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      all.push_back({i, rows[i].lower, rows[i].upper, rows[i].scale});
    }
    return all;
  }
};

inline Parameter toy_row(ParameterKind kind, double lower, double upper) {
  Parameter row;
  row.key = "toy";
  row.unit = "-";
  row.kind = kind;
  row.lower = lower;
  row.upper = upper;
  row.nominal = lower;
  return row;
}

inline Toy sphere(std::size_t dimension) {
  Toy toy;
  toy.rows.assign(dimension, toy_row(ParameterKind::kReal, -5, 3));
  toy.cost = [](const ParameterValues& x) {
    double sum = 0;
    for (double value : x) sum += value * value;
    return sum;
  };
  return toy;
}

inline Toy rosenbrock(std::size_t dimension) {
  Toy toy;
  toy.rows.assign(dimension, toy_row(ParameterKind::kReal, -2, 3));
  toy.cost = [](const ParameterValues& x) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
      const double valley = x[i + 1] - x[i] * x[i];
      sum += 100 * valley * valley + (1 - x[i]) * (1 - x[i]);
    }
    return sum;
  };
  return toy;
}

inline Toy rastrigin(std::size_t dimension) {
  Toy toy;
  toy.rows.assign(dimension, toy_row(ParameterKind::kReal, -5.12, 4));
  toy.cost = [](const ParameterValues& x) {
    double sum = 0;
    for (double value : x) {
      sum += 10 + value * value - 10 * std::cos(2 * std::numbers::pi * value);
    }
    return sum;
  };
  return toy;
}

// Least, 0, at reals 1, integers 7, true, choice 3; a wrong switch or choice costs 1.
inline Toy mixed() {
  Toy toy;
  for (int i = 0; i < 3; ++i) toy.rows.push_back(toy_row(ParameterKind::kReal, 0, 4));
  for (int i = 0; i < 2; ++i) toy.rows.push_back(toy_row(ParameterKind::kInteger, -5, 20));
  for (int i = 0; i < 2; ++i) toy.rows.push_back(toy_row(ParameterKind::kBoolean, 0, 1));
  toy.rows.push_back(toy_row(ParameterKind::kChoice, 0, 4));
  toy.rows.back().choices = {"a", "b", "c", "d", "e"};
  toy.cost = [](const ParameterValues& x) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) sum += (x[i] - 1) * (x[i] - 1);
    for (std::size_t i = 3; i < 5; ++i) sum += 0.05 * (x[i] - 7) * (x[i] - 7);
    for (std::size_t i = 5; i < 7; ++i) sum += 1 - x[i];
    return sum + (x[7] == 3 ? 0 : 1);
  };
  return toy;
}

// One optimiser on one toy, scored in place.
class ToyRun {
 public:
  ToyRun(Toy toy, EvolutionSettings settings, std::uint64_t seed, bool noisy = false)
      : toy_(std::move(toy)), table_(toy_.table()) {
    setup_.settings = std::move(settings);
    setup_.table = &table_;
    setup_.genes = toy_.genes();
    setup_.run_seed = seed;
    setup_.noisy = noisy;
    optimiser_ = make_optimiser(setup_).value();
  }

  ParameterValues values(const Genome& genome) const {
    ParameterValues all = table_.nominal();
    decode(table_, setup_.genes, genome, all);
    return all;
  }

  Score score(const Candidate& candidate) const {
    if (scorer) return scorer(candidate);
    return {v1::OK, toy_.cost(values(candidate.genome))};
  }

  std::vector<Candidate> generation() {
    std::vector<Candidate> all;
    for (const auto before = optimiser_->generation(); optimiser_->generation() == before;) {
      std::vector<Score> scores;
      for (const Candidate& candidate : optimiser_->ask()) {
        scores.push_back(score(candidate));
        all.push_back(candidate);
      }
      optimiser_->tell(scores);
    }
    return all;
  }

  void until(std::uint64_t evaluations) {
    for (int i = 0; i < 10000 && optimiser_->evaluations() < evaluations; ++i) generation();
  }

  // Goes on from the saved state in a new optimiser.
  void reload() { optimiser_ = restore_optimiser(setup_, optimiser_->state()).value(); }

  Optimiser& optimiser() { return *optimiser_; }
  const OptimiserSetup& setup() const { return setup_; }

  std::function<Score(const Candidate&)> scorer;  // instead of the toy's own cost

 private:
  Toy toy_;
  ParameterTable table_;
  OptimiserSetup setup_;
  std::unique_ptr<Optimiser> optimiser_;
};

}  // namespace gapfarm
