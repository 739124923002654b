#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/OrderingMethods>

#include "optimization/normal_equations.hpp"

namespace flyball::optimization::detail {

NormalEquations::NormalEquations(GraphFunctions& graph) : graph_(graph) {
  order();
  lay_out();
  cholesky_.analyzePattern(H_);
}

/// The variables in an order of least fill: approximate minimum degree on the graph of variables
/// that share a factor.
void NormalEquations::order() {
  const auto variables = graph_.sizes.size();
  std::vector<Eigen::Triplet<double>> edges;
  for (const auto& factor : graph_.factors) {
    for (int i = 0; i < factor.count; ++i) {
      for (int j = 0; j < factor.count; ++j) {
        edges.emplace_back(graph_.links[factor.first_link + static_cast<std::size_t>(i)],
                           graph_.links[factor.first_link + static_cast<std::size_t>(j)], 1.0);
      }
    }
  }
  const auto n = static_cast<Index>(variables);
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(edges.begin(), edges.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);
  position_.resize(variables);
  for (std::size_t k = 0; k < variables; ++k) {
    position_[static_cast<std::size_t>(order.indices()(static_cast<Index>(k)))] =
        static_cast<int>(k);
  }
  std::vector<int> by_position(variables);
  for (std::size_t v = 0; v < variables; ++v) {
    by_position[static_cast<std::size_t>(position_[v])] = static_cast<int>(v);
  }
  graph_.offsets.assign(variables, 0);
  int offset = 0;
  for (const int v : by_position) {
    graph_.offsets[static_cast<std::size_t>(v)] = offset;
    offset += graph_.sizes[static_cast<std::size_t>(v)];
  }
  gradient_.setZero(offset);
  diagonal_of_H_.setZero(offset);
}

void NormalEquations::lay_out() {
  const auto variables = graph_.sizes.size();
  const auto size_of = [&](int v) { return graph_.sizes[static_cast<std::size_t>(v)]; };
  const auto before = [&](int a, int b) {
    return position_[static_cast<std::size_t>(a)] < position_[static_cast<std::size_t>(b)];
  };
  // The blocks above the diagonal of each variable's columns, itself last.
  std::vector<std::vector<int>> above(variables);
  for (const auto& factor : graph_.factors) {
    const int* links = graph_.links.data() + factor.first_link;
    for (int i = 0; i < factor.count; ++i) {
      for (int j = 0; j < factor.count; ++j) {
        if (before(links[i], links[j])) {
          above[static_cast<std::size_t>(links[j])].push_back(links[i]);
        }
      }
    }
  }
  std::vector<int> by_position(variables);
  for (std::size_t v = 0; v < variables; ++v) {
    by_position[static_cast<std::size_t>(position_[v])] = static_cast<int>(v);
    auto& blocks = above[v];
    std::sort(blocks.begin(), blocks.end(), before);
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    blocks.push_back(static_cast<int>(v));
  }
  const Index n = gradient_.size();
  H_.resize(n, n);
  std::vector<Index> begin(variables);   // Of a variable's columns among the values.
  std::vector<Index> height(variables);  // Of each of them.
  Index values = 0;
  for (const int v : by_position) {
    const auto index = static_cast<std::size_t>(v);
    begin[index] = values;
    height[index] = std::accumulate(above[index].begin(), above[index].end(), Index{0},
                                    [&](Index sum, int b) { return sum + size_of(b); });
    values += height[index] * size_of(v);
  }
  H_.resizeNonZeros(values);
  diagonal_.resize(static_cast<std::size_t>(n));
  for (const int v : by_position) {
    const auto index = static_cast<std::size_t>(v);
    for (int c = 0; c < size_of(v); ++c) {
      const Index column = graph_.offsets[index] + c;
      Index at = begin[index] + c * height[index];
      H_.outerIndexPtr()[column] = static_cast<int>(at);
      for (const int b : above[index]) {
        for (int r = 0; r < size_of(b); ++r, ++at) {
          H_.innerIndexPtr()[at] = graph_.offsets[static_cast<std::size_t>(b)] + r;
        }
      }
      diagonal_[static_cast<std::size_t>(column)] = at - size_of(v) + c;
    }
  }
  H_.outerIndexPtr()[n] = static_cast<int>(values);
  for (const auto& factor : graph_.factors) {
    first_place_.push_back(places_.size());
    const int* links = graph_.links.data() + factor.first_link;
    std::vector<int> starts(static_cast<std::size_t>(factor.count), 0);
    for (int i = 1; i < factor.count; ++i) {
      starts[static_cast<std::size_t>(i)] = starts[static_cast<std::size_t>(i - 1)] +
                                            graph_.tangents[static_cast<std::size_t>(links[i - 1])];
    }
    for (int i = 0; i < factor.count; ++i) {
      for (int j = 0; j < factor.count; ++j) {
        const bool wanted = i == j || before(links[i], links[j]) ||
                            (links[i] == links[j]);  // A variable may stand twice in a factor.
        if (!wanted || size_of(links[i]) == 0 || size_of(links[j]) == 0) {
          continue;
        }
        const auto column = static_cast<std::size_t>(links[j]);
        Index row = 0;
        for (const int b : above[column]) {
          if (b == links[i]) {
            break;
          }
          row += size_of(b);
        }
        places_.push_back({i, j, starts[static_cast<std::size_t>(i)],
                           starts[static_cast<std::size_t>(j)], size_of(links[i]),
                           size_of(links[j]), begin[column] + row, height[column]});
      }
    }
  }
  first_place_.push_back(places_.size());
}

bool NormalEquations::linearize(std::size_t& failed) {
  gradient_.setZero();
  Eigen::Map<VectorXd>(H_.valuePtr(), H_.nonZeros()).setZero();
  cost_ = 0.0;
  VectorXd r_memory;
  VectorXd J_memory;
  for (std::size_t f = 0; f < graph_.factors.size(); ++f) {
    const auto& factor = graph_.factors[f];
    const int* links = graph_.links.data() + factor.first_link;
    int columns = 0;
    for (int i = 0; i < factor.count; ++i) {
      columns += graph_.tangents[static_cast<std::size_t>(links[i])];
    }
    const Index rows = factor.rows;
    if (J_memory.size() < rows * columns) {
      J_memory.resize(rows * columns);
    }
    if (r_memory.size() < rows) {
      r_memory.resize(rows);
    }
    double* r = r_memory.data();
    double* J = J_memory.data();
    graph_.evaluate(f, r, J);
    double square = 0.0;
    for (Index i = 0; i < rows; ++i) {
      square += r[i] * r[i];
    }
    const LossValue loss = factor.loss(square);
    double check = loss.value;
    for (Index i = 0; i < rows * columns; ++i) {
      check += 0.0 * J[i];
    }
    if (!std::isfinite(check)) {
      failed = f;
      return false;
    }
    cost_ += loss.value;
    for (std::size_t k = first_place_[f]; k < first_place_[f + 1]; ++k) {
      const Place& place = places_[k];
      const bool diagonal = place.row_variable == place.column_variable;
      for (int c = 0; c < place.column_size; ++c) {
        const double* Jc = J + (place.column_begin + c) * rows;
        double* target = H_.valuePtr() + place.value + c * place.stride;
        for (int i = 0; i < place.row_size; ++i) {
          const double* Ji = J + (place.row_begin + i) * rows;
          double sum = 0.0;
          for (Index q = 0; q < rows; ++q) {
            sum += Ji[q] * Jc[q];
          }
          target[i] += loss.slope * sum;
        }
        if (diagonal) {
          double sum = 0.0;
          for (Index q = 0; q < rows; ++q) {
            sum += Jc[q] * r[q];
          }
          gradient_(graph_.offsets[static_cast<std::size_t>(links[place.column_variable])] + c) +=
              loss.slope * sum;
        }
      }
    }
  }
  for (Index i = 0; i < gradient_.size(); ++i) {
    diagonal_of_H_(i) = H_.valuePtr()[diagonal_[static_cast<std::size_t>(i)]];
  }
  return true;
}

bool NormalEquations::solve(double damping, VectorXd& step) {
  for (Index i = 0; i < gradient_.size(); ++i) {
    H_.valuePtr()[diagonal_[static_cast<std::size_t>(i)]] = (1.0 + damping) * diagonal_of_H_(i);
  }
  cholesky_.factorize(H_);
  if (cholesky_.info() != Eigen::Success) {
    return false;
  }
  step = cholesky_.solve(-gradient_);
  return step.allFinite();
}

double NormalEquations::damping_part(double damping, const VectorXd& step) const {
  return damping * step.cwiseAbs2().dot(diagonal_of_H_);
}

int NormalEquations::variable_of(Index entry) const {
  for (std::size_t v = 0; v < graph_.sizes.size(); ++v) {
    if (entry >= graph_.offsets[v] && entry < graph_.offsets[v] + graph_.sizes[v]) {
      return static_cast<int>(v);
    }
  }
  return -1;
}

Index NormalEquations::lost_pivot() {
  constexpr double lost = 64.0 * std::numeric_limits<double>::epsilon();
  VectorXd step;
  if (solve(0.0, step)) {
    const Eigen::SparseMatrix<double>& L = cholesky_.matrixL().nestedExpression();
    for (Index j = 0; j < L.cols(); ++j) {
      const double pivot = L.valuePtr()[L.outerIndexPtr()[j]];
      if (!(pivot * pivot > lost * diagonal_of_H_(j))) {
        return j;
      }
    }
    return -1;
  }
  // The decomposition ended at the pivot that was not positive: find it with the least damping that
  // carries it through.
  for (double damping = 1e-15; damping < 1.0; damping *= 10.0) {
    if (solve(damping, step)) {
      const Eigen::SparseMatrix<double>& L = cholesky_.matrixL().nestedExpression();
      Index smallest = 0;
      double least = std::numeric_limits<double>::infinity();
      for (Index j = 0; j < L.cols(); ++j) {
        const double pivot = L.valuePtr()[L.outerIndexPtr()[j]];
        const double share = diagonal_of_H_(j) > 0.0 ? pivot * pivot / diagonal_of_H_(j) : -1.0;
        if (share < least) {
          least = share;
          smallest = j;
        }
      }
      return smallest;
    }
  }
  Index zero = 0;
  diagonal_of_H_.minCoeff(&zero);
  return zero;
}

Index NormalEquations::factor_nonzeros() const {
  return cholesky_.matrixL().nestedExpression().nonZeros();
}

std::vector<Eigen::MatrixXd> NormalEquations::inverse_blocks() const {
  const Eigen::SparseMatrix<double>& L = cholesky_.matrixL().nestedExpression();
  const Index n = L.cols();
  const auto* outer = L.outerIndexPtr();
  const auto* inner = L.innerIndexPtr();
  const double* value = L.valuePtr();
  // Z = (L Lᵀ)⁻¹ on the pattern of L: Z L = L⁻ᵀ, whose part below the diagonal is zero.
  std::vector<double> Z(static_cast<std::size_t>(L.nonZeros()), 0.0);
  VectorXd column = VectorXd::Zero(n);                           // Σ_k Z_ik L_kj, by i.
  std::vector<double> weight(static_cast<std::size_t>(n), 0.0);  // L_kj, by k.
  for (Index j = n; j-- > 0;) {
    for (int p = outer[j] + 1; p < outer[j + 1]; ++p) {
      weight[static_cast<std::size_t>(inner[p])] = value[p];
      column(inner[p]) = 0.0;
    }
    for (int p = outer[j] + 1; p < outer[j + 1]; ++p) {
      const int k = inner[p];
      column(k) += Z[static_cast<std::size_t>(outer[k])] * value[p];
      for (int q = outer[k] + 1; q < outer[k + 1]; ++q) {
        const int i = inner[q];
        const double l = weight[static_cast<std::size_t>(i)];
        if (l != 0.0) {
          const double z = Z[static_cast<std::size_t>(q)];
          column(i) += z * value[p];
          column(k) += z * l;
        }
      }
    }
    const double pivot = value[outer[j]];
    double own = 1.0 / pivot;
    for (int p = outer[j] + 1; p < outer[j + 1]; ++p) {
      const double z = -column(inner[p]) / pivot;
      Z[static_cast<std::size_t>(p)] = z;
      own -= value[p] * z;
    }
    Z[static_cast<std::size_t>(outer[j])] = own / pivot;
    for (int p = outer[j] + 1; p < outer[j + 1]; ++p) {
      weight[static_cast<std::size_t>(inner[p])] = 0.0;
    }
  }
  std::vector<Eigen::MatrixXd> blocks(graph_.sizes.size());
  for (std::size_t v = 0; v < blocks.size(); ++v) {
    const int size = graph_.sizes[v];
    Eigen::MatrixXd& block = blocks[v];
    block.setZero(size, size);
    for (int c = 0; c < size; ++c) {
      const int j = graph_.offsets[v] + c;
      for (int p = outer[j]; p < outer[j + 1] && inner[p] < graph_.offsets[v] + size; ++p) {
        const int r = inner[p] - graph_.offsets[v];
        block(r, c) = block(c, r) = Z[static_cast<std::size_t>(p)];
      }
    }
  }
  return blocks;
}

}  // namespace flyball::optimization::detail
