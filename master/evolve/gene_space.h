// What the values of each gene mean to the operators: real, ordered levels or unordered ones.
#pragma once

#include <vector>

#include "common/parameters/table.h"
#include "common/random/stream.h"

namespace gapfarm {

enum class GeneShape {
  kReal,       // any value in [0, 1]
  kOrdered,    // integers: `levels` equal shares, neighbours are alike
  kUnordered,  // booleans and choices: `levels` equal shares, no neighbours
};

struct GeneKind {
  GeneShape shape = GeneShape::kReal;
  std::size_t levels = 0;  // of ordered and unordered genes, at least 1; 0: real
};

// Genomes leave every function below snapped: a gene with levels sits in the middle of its share,
// (k + 1/2) / levels, so equal decoded values are equal genes, bit for bit.
class GeneSpace {
 public:
  // A gene whose range is one value has one level.
  GeneSpace(const ParameterTable& table, const std::vector<Gene>& genes);
  explicit GeneSpace(std::vector<GeneKind> kinds) : kinds_(std::move(kinds)) {}

  std::size_t size() const { return kinds_.size(); }
  const GeneKind& operator[](std::size_t gene) const { return kinds_[gene]; }

  // Nearest member of the space: clamped to [0, 1], levels snapped.
  double snapped(std::size_t gene, double g) const;
  Genome snapped(Genome genome) const;

  // Uniform over the gene's values.
  double random(std::size_t gene, Stream& stream) const;
  Genome random(Stream& stream) const;

  // A Gaussian step of s.d. `sigma` (share of the range), reflected at the ends.  An ordered gene
  // moves by at least one level; an unordered one goes to another level, each equally likely.
  double stepped(std::size_t gene, double g, double sigma, Stream& stream) const;

  // BLX-alpha of one gene (Eshelman and Schaffer 1993): uniform on the parents' interval widened by
  // `alpha` of its width on both sides, cut off at 0 and 1.  Unordered genes come from a parent.
  double blended(std::size_t gene, double a, double b, double alpha, Stream& stream) const;

 private:
  std::size_t level(std::size_t gene, double g) const;
  double middle(std::size_t gene, std::size_t level) const;

  std::vector<GeneKind> kinds_;
};

}  // namespace gapfarm
