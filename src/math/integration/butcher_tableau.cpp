#include <flyball/math/integration/butcher_tableau.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "math/dense/dense.hpp"

namespace flyball {

namespace {

/// A rooted tree by its root's subtrees, given as places in a list of smaller trees, and what the
/// conditions need of it.
struct RootedTree {
  int vertices = 1;
  double density = 1.0;         ///< γ: the product of the sizes of all its subtrees.
  std::vector<double> weights;  ///< The product over the root's subtrees, for each stage.
};

/// All trees of up to `order` vertices, each from a nondecreasing sequence of smaller ones.
class Trees {
 public:
  Trees(const ButcherTableauView& tableau, int order) : tableau_(tableau) {
    trees_.push_back({1, 1.0, std::vector<double>(tableau.stages, 1.0)});
    for (int vertices = 2; vertices <= order; ++vertices) {
      const std::size_t smaller = trees_.size();
      extend({1, 1.0, std::vector<double>(tableau.stages, 1.0)}, vertices, 0, smaller);
    }
  }

  [[nodiscard]] const std::vector<RootedTree>& all() const noexcept { return trees_; }

 private:
  /// Gives the root of `tree` subtrees from the place `first` on, until it has all its vertices.
  void extend(const RootedTree& tree, int vertices, std::size_t first, std::size_t smaller) {
    if (tree.vertices == vertices) {
      RootedTree whole = tree;
      whole.density *= vertices;
      trees_.push_back(std::move(whole));
      return;
    }
    for (std::size_t k = first; k < smaller; ++k) {
      const int size = trees_[k].vertices;
      if (tree.vertices + size > vertices) {
        break;
      }
      RootedTree larger{tree.vertices + size, tree.density * trees_[k].density, tree.weights};
      for (std::size_t i = 0; i < tableau_.stages; ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j < tableau_.stages; ++j) {
          sum += tableau_.A[i * tableau_.stages + j] * trees_[k].weights[j];
        }
        larger.weights[i] *= sum;
      }
      extend(larger, vertices, k, smaller);
    }
  }

  const ButcherTableauView& tableau_;
  std::vector<RootedTree> trees_;
};

}  // namespace

double order_condition_residual(const ButcherTableauView& tableau, int order) {
  double worst = 0.0;
  const Trees trees(tableau, order);
  for (const RootedTree& tree : trees.all()) {
    if (tree.vertices != order) {
      continue;
    }
    double weight = 0.0;
    for (std::size_t i = 0; i < tableau.stages; ++i) {
      weight += tableau.b[i] * tree.weights[i];
    }
    worst = std::max(worst, std::abs(weight - 1.0 / tree.density));
  }
  return worst;
}

std::complex<double> stability_function(const ButcherTableauView& tableau, std::complex<double> z) {
  const auto stages = static_cast<Eigen::Index>(tableau.stages);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::MatrixXcd M =
      Eigen::MatrixXcd::Identity(stages, stages) -
      z * Eigen::Map<const RowMajor>(tableau.A.data(), stages, stages).cast<std::complex<double>>();
  double rcond = 0.0;
  const Eigen::MatrixXcd k = detail::solve_complex(M, Eigen::MatrixXcd::Ones(stages, 1), &rcond);
  if (rcond == 0.0) {
    return std::numeric_limits<double>::infinity();
  }
  std::complex<double> sum = 0.0;
  for (Eigen::Index i = 0; i < stages; ++i) {
    sum += tableau.b[static_cast<std::size_t>(i)] * k(i, 0);
  }
  return 1.0 + z * sum;
}

}  // namespace flyball
