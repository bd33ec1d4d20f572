// Rosenbrock's valley within a disc, as rosenbrock.py:
//   g++ -std=c++17 -O2 -o rosenbrock rosenbrock.cc
#include "objective.h"

int main() {
  return gapfarm::serve(
      "Rosenbrock's valley",
      R"({"key":"x","lower":-2,"upper":2,"nominal":-1},)"
      R"({"key":"y","lower":-2,"upper":2,"nominal":0.5})",
      [](const gapfarm::Question& question) {
        const double x = question.number("x"), y = question.number("y");
        const double ahead = 1 - x, beside = y - x * x;
        return gapfarm::Answer{ahead * ahead + 100 * (beside * beside), {x * x + y * y - 2}};
      });
}
