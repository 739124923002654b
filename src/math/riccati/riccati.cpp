#include <flyball/math/riccati/riccati.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/riccati/riccati_kernel.hpp"
#include "math/riccati/riccati_robust.hpp"

namespace flyball {

namespace {

Expected<void> check_shapes(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                            const MatrixRef& R, const MatrixRef* N, std::string_view where) {
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const bool right = n > 0 && m > 0 && A.cols() == n && B.rows() == n && Q.rows() == n &&
                     Q.cols() == n && R.rows() == m && R.cols() == m &&
                     (N == nullptr || (N->rows() == n && N->cols() == m));
  if (right) {
    return {};
  }
  FLYBALL_CHECK(check_square(A, where, "A"));
  if (m == 0) {
    return refusal(ArgumentError::empty, where, "B")
        .got("without columns")
        .expected("states x inputs with at least one input");
  }
  auto shapes = Checks(where)
                    .shape(B, n, m, "B", "states x inputs")
                    .shape(Q, n, n, "Q", "states x states")
                    .shape(R, m, m, "R", "inputs x inputs");
  return shapes && N != nullptr ? check_shape(*N, n, m, where, "N", "states x inputs") : shapes;
}

Expected<void> check_values(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                            const MatrixRef& R, const MatrixRef& N, std::string_view where) {
  FLYBALL_CHECK(
      Checks(where).finite(A, "A").finite(B, "B").finite(Q, "Q").finite(R, "R").finite(N, "N"));
  return Checks(where).symmetric(Q, "Q").symmetric(R, "R");
}

/// The largest magnitude; not a number where one is not, infinite where one is.
double largest_of(const double* values, int count) {
  double most = 0.0;
  double sum = 0.0;
  for (int k = 0; k < count; ++k) {
    most = std::max(most, std::abs(values[k]));
    sum += 0.0 * values[k];
  }
  return most + sum;
}

/// Whether products of such numbers and their squares are far from the ends of the doubles' range.
bool is_ordinary(double size) {
  return size < 0x1p100 && (size == 0.0 || size > 0x1p-100);
}

/// Whether the kernel's units, √X_ii, are so far apart that a rounding error of the closed loop in
/// them is more in those that were given: its poles may be another loop's there.
bool in_units_far_apart(const double* X, int n) {
  constexpr double far = 0x1p24;  // of the squares
  double least = std::abs(X[0]);
  double most = least;
  for (int i = 1; i < n; ++i) {
    least = std::min(least, std::abs(X[i * (n + 1)]));
    most = std::max(most, std::abs(X[i * (n + 1)]));
  }
  return most > far * least;
}

using ConstMap = Eigen::Map<const Eigen::MatrixXd>;

Eigen::MatrixXd cross_weight(const detail::RiccatiData& data) {
  return data.N == nullptr ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(data.states, data.inputs))
                           : Eigen::MatrixXd(ConstMap(data.N, data.states, data.inputs));
}

/// Whether the kernel's answer leaves little of its equations in the units that were given, too;
/// then with the poles that A - BK has in them.
bool holds_in_given_units(const detail::RiccatiData& data, detail::RiccatiAnswer& answer) {
  constexpr double little = 1e-11;
  const int n = data.states;
  const int m = data.inputs;
  const detail::RiccatiProblem problem{ConstMap(data.A, n, n),
                                       ConstMap(data.B, n, m),
                                       detail::symmetrized(ConstMap(data.Q, n, n)),
                                       detail::symmetrized(ConstMap(data.R, m, m)),
                                       cross_weight(data),
                                       data.continuous};
  const Eigen::MatrixXd K = ConstMap(answer.K, m, n);
  const double residual = detail::riccati_residual(problem, ConstMap(answer.X, n, n), K);
  if (!(residual <= little)) {
    return false;
  }
  // One of doubles that cancel says nothing.
  answer.residual =
      answer.residual <= detail::largest_residual ? std::max(answer.residual, residual) : residual;
  if (n > detail::most_states_in_twice) {
    return true;
  }
  const auto poles = detail::riccati_poles(problem.A, problem.B, K);
  if (!poles || !detail::are_stable(*poles, data.continuous)) {
    return false;
  }
  Eigen::Map<Eigen::VectorXcd>(answer.poles, n) = *poles;
  return true;
}

/// The kernel in units by powers of two that balance A, of many states whose units make A far
/// larger than its eigenvalues: doubling would take many steps, and lose as many digits, for
/// nothing. False where the units are not so, or where the kernel does not vouch for its result.
bool solve_in_balanced_units(const detail::RiccatiData& data, detail::RiccatiAnswer& answer) {
  constexpr double far_larger = 64.0;
  const int n = data.states;
  const int m = data.inputs;
  if (n <= detail::kernel_few_states) {
    return false;
  }
  const ConstMap A(data.A, n, n);
  const Eigen::VectorXd d = detail::balance_of(A);
  const Eigen::VectorXd inverse = d.cwiseInverse();
  const Eigen::MatrixXd scaled_A = inverse.asDiagonal() * A * d.asDiagonal();
  if (!(far_larger * detail::norm1(scaled_A) < detail::norm1(A))) {
    return false;
  }
  const Eigen::MatrixXd B = inverse.asDiagonal() * ConstMap(data.B, n, m);
  const Eigen::MatrixXd Q = d.asDiagonal() * ConstMap(data.Q, n, n) * d.asDiagonal();
  const Eigen::MatrixXd N = d.asDiagonal() * cross_weight(data);
  const detail::RiccatiData scaled{n,
                                   m,
                                   scaled_A.data(),
                                   B.data(),
                                   Q.data(),
                                   data.R,
                                   data.N == nullptr ? nullptr : N.data(),
                                   data.continuous};
  if (!detail::solve_riccati_quickly(scaled, answer)) {
    return false;
  }
  Eigen::Map<Eigen::MatrixXd> X(answer.X, n, n);
  Eigen::Map<Eigen::MatrixXd> K(answer.K, m, n);
  X = (inverse.asDiagonal() * X * inverse.asDiagonal()).eval();
  K = (K * inverse.asDiagonal()).eval();
  return X.allFinite() && K.allFinite();
}

/// The same answer as check_symmetric without its message; S finite.
bool symmetric(const double* S, int n) {
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < j; ++i) {
      const double above = S[i + j * n];
      const double below = S[j + i * n];
      if (above != below &&
          !(std::abs(above - below) <= 1e-10 * std::max({std::abs(above), std::abs(below),
                                                         std::sqrt(std::abs(S[i + i * n])) *
                                                             std::sqrt(std::abs(S[j + j * n]))}))) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

ErrorInfo error_info(RiccatiError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_stabilizable", "a mode that is not stable is reached by no input",
       ErrorKind::no_answer},
      {"no_stabilizing_solution", "no stabilising solution exists", ErrorKind::no_answer},
      {"singular", "R + B'XB has no inverse", ErrorKind::no_answer},
      {"no_convergence", "no solution was found that could be verified", ErrorKind::no_answer},
      {"overflow", "the solution exceeds the largest double", ErrorKind::no_answer},
  };
  return detail::info_of(code, "riccati", rows);
}

namespace detail {

namespace {

/// (M + Mᵀ)/2, where the sum has a double.
Eigen::MatrixXd symmetric_part(const ConstMap& M) {
  Eigen::MatrixXd mean = symmetrized(M);
  return mean.allFinite() ? mean : Eigen::MatrixXd(0.5 * M + 0.5 * M.transpose());
}

Expected<void> solve_riccati_within(const RiccatiData& data, RiccatiAnswer& answer,
                                    CarefulWork* work) {
  constexpr double nearly_nothing = 0x1p-800;
  const int n = data.states;
  const int m = data.inputs;
  const double size_A = largest_of(data.A, n * n);
  const bool ordinary =
      (is_ordinary(size_A) ||
       (size_A < 1.0 && !data.continuous && !(size_A > 0.0 && size_A < nearly_nothing))) &&
      is_ordinary(largest_of(data.B, n * m)) && is_ordinary(largest_of(data.Q, n * n)) &&
      is_ordinary(largest_of(data.R, m * m)) &&
      (data.N == nullptr || is_ordinary(largest_of(data.N, n * m)));
  if (ordinary && symmetric(data.Q, n) && symmetric(data.R, m) &&
      (solve_in_balanced_units(data, answer) || solve_riccati_quickly(data, answer))) {
    if (answer.residual <= largest_residual && !in_units_far_apart(answer.X, n)) {
      return {};
    }
    if (holds_in_given_units(data, answer)) {
      return {};
    }
  }
  const ConstMap A(data.A, n, n);
  const ConstMap B(data.B, n, m);
  const ConstMap Q(data.Q, n, n);
  const ConstMap R(data.R, m, m);
  const Eigen::MatrixXd N = cross_weight(data);
  FLYBALL_CHECK(check_values(A, B, Q, R, N, data.continuous ? "care" : "dare"));
  const RiccatiProblem problem{A, B,   symmetric_part(Q), symmetric_part(R), N, data.continuous,
                               0, work};
  FLYBALL_TRY(auto solution,
              ordinary ? solve_riccati_robustly(problem) : solve_riccati_in_other_units(problem));
  Eigen::Map<Eigen::MatrixXd>(answer.X, n, n) = solution.X;
  Eigen::Map<Eigen::MatrixXd>(answer.K, m, n) = solution.K;
  Eigen::Map<Eigen::VectorXcd>(answer.poles, n) = solution.poles;
  answer.residual = solution.residual;
  answer.condition = solution.condition;
  answer.iterations = solution.iterations;
  return {};
}

}  // namespace

Expected<void> solve_riccati(const RiccatiData& data, RiccatiAnswer& answer) {
  return solve_riccati_within(data, answer, nullptr);
}

}  // namespace detail

namespace {

Expected<RiccatiSolution> solve(bool continuous, const MatrixRef& A, const MatrixRef& B,
                                const MatrixRef& Q, const MatrixRef& R, const MatrixRef* N,
                                detail::CarefulWork* work = nullptr) {
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  FLYBALL_CHECK(check_shapes(A, B, Q, R, N, continuous ? "care" : "dare"));
  if (A.outerStride() != n || B.outerStride() != n || Q.outerStride() != n ||
      R.outerStride() != m || (N != nullptr && N->outerStride() != n)) {
    // Blocks of larger matrices: copied, because the kernels take columns without gaps.
    const Eigen::MatrixXd cross = N == nullptr ? Eigen::MatrixXd::Zero(n, m) : Eigen::MatrixXd(*N);
    const MatrixRef whole = cross;
    return solve(continuous, Eigen::MatrixXd(A), Eigen::MatrixXd(B), Eigen::MatrixXd(Q),
                 Eigen::MatrixXd(R), &whole, work);
  }
  Expected<RiccatiSolution> solution;
  solution->X.resize(n, n);
  solution->K.resize(m, n);
  solution->poles.resize(n);
  detail::RiccatiAnswer answer{solution->X.data(), solution->K.data(), solution->poles.data()};
  FLYBALL_CHECK(detail::solve_riccati_within(
      {static_cast<int>(n), static_cast<int>(m), A.data(), B.data(), Q.data(), R.data(),
       N == nullptr ? nullptr : N->data(), continuous},
      answer, work));
  solution->residual = answer.residual;
  solution->condition = answer.condition;
  solution->iterations = answer.iterations;
  return solution;
}

}  // namespace

Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R, const MatrixRef& N) {
  return solve(false, A, B, Q, R, &N);
}

Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R) {
  return solve(false, A, B, Q, R, nullptr);
}

Expected<RiccatiSolution> care(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R, const MatrixRef& N) {
  return solve(true, A, B, Q, R, &N);
}

Expected<RiccatiSolution> care(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R) {
  return solve(true, A, B, Q, R, nullptr);
}

namespace detail {

Expected<RiccatiSolution> dare_within(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                      const MatrixRef& R, const MatrixRef& N, CarefulWork& work) {
  return flyball::solve(false, A, B, Q, R, &N, &work);
}

Expected<RiccatiSolution> care_within(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                      const MatrixRef& R, const MatrixRef& N, CarefulWork& work) {
  return flyball::solve(true, A, B, Q, R, &N, &work);
}

}  // namespace detail

}  // namespace flyball
