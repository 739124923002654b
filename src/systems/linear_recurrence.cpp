#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "systems/linear_recurrence.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Σ aᵢxᵢ + last in two halves: what comes after waits for fewer additions.
template <std::size_t N>
inline double inner(const std::array<double, N>& a, const std::array<double, N>& x, double last) {
  double even = a[0] * x[0];
  double odd = last;
  for (std::size_t i = 1; i < N; i += 2) {
    odd += a[i] * x[i];
    if (i + 1 < N) {
      even += a[i + 1] * x[i + 1];
    }
  }
  return even + odd;
}

template <std::size_t N>
std::array<double, N> row_of(const MatrixXd& M, Index row) {
  std::array<double, N> entries{};
  for (std::size_t j = 0; j < N; ++j) {
    entries[j] = M(row, static_cast<Index>(j));
  }
  return entries;
}

/// One input: all coefficients and the state are in registers.
template <std::size_t N>
void run_single(const DiscreteSystem<>& system, const MatrixRef& u, VectorXd& state, double* states,
                Index rows, MatrixXd& y) {
  std::array<std::array<double, N>, N> A{};
  std::array<double, N> b{};
  std::array<double, N> x{};
  for (std::size_t i = 0; i < N; ++i) {
    A[i] = row_of<N>(system.A, static_cast<Index>(i));
    b[i] = system.B(static_cast<Index>(i), 0);
    x[i] = state(static_cast<Index>(i));
  }
  const std::array<double, N> c = row_of<N>(system.C, 0);
  const double d = system.D(0, 0);
  const double* const input = u.data();
  double* const output = y.data();
  const Index samples = u.rows();
  for (Index k = 0; k < samples; ++k) {
    output[k] = inner<N>(c, x, d * input[k]);
    std::array<double, N> next{};
    for (std::size_t i = 0; i < N; ++i) {
      next[i] = inner<N>(A[i], x, b[i] * input[k]);
    }
    x = next;
    if (states != nullptr) {
      for (std::size_t i = 0; i < N; ++i) {
        states[static_cast<Index>(i) * rows + k + 1] = x[i];
      }
    }
  }
  std::copy(x.begin(), x.end(), state.begin());
}

using Run = void (*)(const DiscreteSystem<>&, const MatrixRef&, VectorXd&, double*, Index,
                     MatrixXd&);

template <std::size_t... N>
constexpr std::array<Run, sizeof...(N)> single(std::index_sequence<N...> /*sizes*/) {
  return {&run_single<N + 1>...};
}

}  // namespace

void run_recurrence(const DiscreteSystem<>& system, const MatrixRef& u, VectorXd& x, double* states,
                    Index rows, MatrixXd& y) {
  static constexpr auto runs = single(std::make_index_sequence<6>());
  const auto n = static_cast<std::size_t>(x.size());
  if (n >= 1 && n <= runs.size() && system.B.cols() == 1 && system.C.rows() == 1) {
    runs[n - 1](system, u, x, states, rows, y);
    return;
  }
  VectorXd next(x.size());
  for (Index k = 0; k < u.rows(); ++k) {
    const auto u_k = u.row(k).transpose();
    y.row(k).transpose().noalias() = system.C * x;
    y.row(k).transpose().noalias() += system.D * u_k;
    next.noalias() = system.A * x;
    next.noalias() += system.B * u_k;
    x.swap(next);
    for (Index i = 0; states != nullptr && i < x.size(); ++i) {
      states[i * rows + k + 1] = x(i);
    }
  }
}

}  // namespace flyball::detail
