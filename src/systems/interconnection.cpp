#include <flyball/systems/interconnection.hpp>

#include <cmath>
#include <complex>
#include <string>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/algebraic_loop.hpp"
#include "systems/balance.hpp"
#include "systems/timed.hpp"

namespace flyball {

namespace {

using detail::bare;
using detail::product;
using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

MatrixXd diagonal(const MatrixXd& first, const MatrixXd& second) {
  MatrixXd both = MatrixXd::Zero(first.rows() + second.rows(), first.cols() + second.cols());
  both.topLeftCorner(first.rows(), first.cols()) = first;
  both.bottomRightCorner(second.rows(), second.cols()) = second;
  return both;
}

Expected<void> check_both(const Continuous& first, const Continuous& second,
                          std::string_view where) {
  auto checked = check_system_or_gain(first, where);
  return checked ? check_system_or_gain(second, where) : checked;
}

Expected<void> check_count(Index got, Index expected, std::string_view where,
                           std::string_view subject, std::string_view of) {
  if (got == expected) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, where, subject)
      .got(std::to_string(got))
      .expected(std::to_string(expected) + ", " + std::string(of));
}

Expected<Continuous> connect_series(const Continuous& first, const Continuous& second) {
  constexpr std::string_view where = "series";
  FLYBALL_CHECK(check_both(first, second, where));
  FLYBALL_CHECK(check_count(second.B.cols(), first.C.rows(), where,
                            "the number of the second system's inputs", "the first's outputs"));
  const Index n = first.A.rows();
  const Index k = second.A.rows();
  Continuous both;
  both.A = diagonal(first.A, second.A);
  both.A.bottomLeftCorner(k, n) = product(second.B, first.C);
  both.B.resize(n + k, first.B.cols());
  both.B << first.B, product(second.B, first.D);
  both.C.resize(second.C.rows(), n + k);
  both.C << product(second.D, first.C), second.C;
  both.D = product(second.D, first.D);
  return both;
}

Expected<Continuous> connect_parallel(const Continuous& first, const Continuous& second) {
  constexpr std::string_view where = "parallel";
  FLYBALL_CHECK(check_both(first, second, where));
  FLYBALL_CHECK(check_count(second.B.cols(), first.B.cols(), where,
                            "the number of the second system's inputs", "as the first has"));
  FLYBALL_CHECK(check_count(second.C.rows(), first.C.rows(), where,
                            "the number of the second system's outputs", "as the first has"));
  Continuous both;
  both.A = diagonal(first.A, second.A);
  both.B.resize(both.A.rows(), first.B.cols());
  both.B << first.B, second.B;
  both.C.resize(first.C.rows(), both.A.rows());
  both.C << first.C, second.C;
  both.D = first.D + second.D;
  return both;
}

Expected<Continuous> connect_append(const Continuous& first, const Continuous& second) {
  FLYBALL_CHECK(check_both(first, second, "append"));
  return Continuous{diagonal(first.A, second.A), diagonal(first.B, second.B),
                    diagonal(first.C, second.C), diagonal(first.D, second.D)};
}

Expected<Continuous> connect_feedback(const Continuous& forward, const Continuous& back,
                                      FeedbackSign sign) {
  constexpr std::string_view where = "feedback";
  FLYBALL_CHECK(check_count(back.B.cols(), forward.C.rows(), where,
                            "the number of the feedback path's inputs", "the forward's outputs"));
  FLYBALL_CHECK(check_count(back.C.rows(), forward.B.cols(), where,
                            "the number of the feedback path's outputs", "the forward's inputs"));
  const double s = sign == FeedbackSign::negative ? 1.0 : -1.0;
  const Index n = forward.A.rows();
  const Index k = back.A.rows();
  const Index m = forward.B.cols();
  // e = u - s y₂ and y₂ = C₂x₂ + D₂(C₁x₁ + D₁e): (I + s D₂D₁) e = u - s (C₂x₂ + D₂C₁x₁).
  MatrixXd right(m, n + k + m);
  right << -s * product(back.D, forward.C), -s * back.C, MatrixXd::Identity(m, m);
  FLYBALL_TRY(const MatrixXd e, detail::solve_algebraic_loop(
                                    {back.D, forward.D, s, s > 0.0 ? "I + D1 D2" : "I - D1 D2",
                                     "give one of the paths dynamics: no loop acts instantly"},
                                    right, where));
  Continuous loop_system;
  const MatrixXd y_x1 = forward.C + product(forward.D, e.leftCols(n));
  const MatrixXd y_x2 = product(forward.D, e.middleCols(n, k));
  const MatrixXd y_u = product(forward.D, e.rightCols(m));
  loop_system.A.resize(n + k, n + k);
  loop_system.A << forward.A + product(forward.B, e.leftCols(n)),
      product(forward.B, e.middleCols(n, k)), product(back.B, y_x1), back.A + product(back.B, y_x2);
  loop_system.B.resize(n + k, m);
  loop_system.B << product(forward.B, e.rightCols(m)), product(back.B, y_u);
  loop_system.C.resize(forward.C.rows(), n + k);
  loop_system.C << y_x1, y_x2;
  loop_system.D = y_u;
  return loop_system;
}

Expected<Continuous> close_loop(const Continuous& plant, const MatrixRef& K) {
  constexpr std::string_view where = "closed_loop";
  FLYBALL_CHECK(check_system(plant, where));
  FLYBALL_CHECK(Checks(where)
                    .shape(K, plant.B.cols(), plant.A.rows(), "K", "inputs x states")
                    .finite(K, "K"));
  const MatrixXd BK = product(plant.B, K);
  const MatrixXd DK = product(plant.D, K);
  return Continuous{plant.A - BK, BK, plant.C - DK, DK};
}

/// The same of discrete systems, whose periods must agree.
template <class Connect>
Expected<Discrete> discrete(const Discrete& first, const Discrete& second, std::string_view where,
                            Connect&& connect) {
  for (const Discrete* system : {&first, &second}) {
    FLYBALL_CHECK(check_system_or_gain(*system, where));
  }
  const double T = first.period.si();
  if (!(std::abs(second.period.si() - T) <= 1e-12 * T)) {
    return refusal(SystemError::period_mismatch, where, "the second system's period")
        .got(format_number(second.period.si()) + " s")
        .expected(format_number(T) + " s, the first's")
        .hint("resample one of them");
  }
  return connect(bare(first), bare(second)).map([&](const Continuous& both) {
    return detail::timed(both, first.period);
  });
}

Expected<Continuous> checked_feedback(const Continuous& forward, const Continuous& back,
                                      FeedbackSign sign) {
  FLYBALL_CHECK(check_both(forward, back, "feedback"));
  return connect_feedback(forward, back, sign);
}

Expected<Continuous> unity_feedback(const Continuous& forward, FeedbackSign sign) {
  FLYBALL_CHECK(check_system_or_gain(forward, "feedback"));
  const Index p = forward.C.rows();
  FLYBALL_CHECK(
      check_count(p, forward.B.cols(), "feedback", "the number of outputs", "as there are inputs"));
  return connect_feedback(
      forward, {MatrixXd(0, 0), MatrixXd(0, p), MatrixXd(p, 0), MatrixXd::Identity(p, p)}, sign);
}

Expected<Eigen::MatrixXcd> evaluate(const Continuous& system, std::complex<double> point) {
  constexpr std::string_view where = "transfer_at";
  FLYBALL_CHECK(Checks(where).finite(point.real(), "the point").finite(point.imag(), "the point"));
  if (system.A.size() == 0) {
    return Eigen::MatrixXcd(system.D.cast<std::complex<double>>());
  }
  const auto [A, B, C, D] =
      detail::scaled_system(system, detail::scaling_of(system.A, system.B, system.C));
  Eigen::MatrixXcd shifted = -A.cast<std::complex<double>>();
  shifted.diagonal().array() += point;
  double rcond = 0.0;
  const Eigen::MatrixXcd x = detail::solve_complex(shifted, B.cast<std::complex<double>>(), &rcond);
  if (rcond == 0.0 || !x.allFinite()) {
    return refusal(SystemError::no_image, where, "the point")
        .got("a pole")
        .with("point", std::vector<double>{point.real(), point.imag()});
  }
  return Eigen::MatrixXcd(detail::complex_product(C.cast<std::complex<double>>(), x) +
                          D.cast<std::complex<double>>());
}

}  // namespace

Expected<Continuous> series(const Continuous& first, const Continuous& second) {
  return connect_series(first, second);
}
Expected<Discrete> series(const Discrete& first, const Discrete& second) {
  return discrete(first, second, "series", connect_series);
}

Expected<Continuous> parallel(const Continuous& first, const Continuous& second) {
  return connect_parallel(first, second);
}
Expected<Discrete> parallel(const Discrete& first, const Discrete& second) {
  return discrete(first, second, "parallel", connect_parallel);
}

Expected<Continuous> append(const Continuous& first, const Continuous& second) {
  return connect_append(first, second);
}
Expected<Discrete> append(const Discrete& first, const Discrete& second) {
  return discrete(first, second, "append", connect_append);
}

Expected<Continuous> feedback(const Continuous& forward, const Continuous& back,
                              FeedbackSign sign) {
  return checked_feedback(forward, back, sign);
}
Expected<Discrete> feedback(const Discrete& forward, const Discrete& back, FeedbackSign sign) {
  return discrete(forward, back, "feedback",
                  [&](const Continuous& first, const Continuous& second) {
                    return checked_feedback(first, second, sign);
                  });
}

Expected<Continuous> feedback(const Continuous& forward, FeedbackSign sign) {
  return unity_feedback(forward, sign);
}
Expected<Discrete> feedback(const Discrete& forward, FeedbackSign sign) {
  FLYBALL_CHECK(check_system_or_gain(forward, "feedback"));
  return unity_feedback(bare(forward), sign).map([&](const Continuous& loop) {
    return detail::timed(loop, forward.period);
  });
}

Expected<Continuous> closed_loop(const Continuous& plant, const MatrixRef& K) {
  return close_loop(plant, K);
}
Expected<Discrete> closed_loop(const Discrete& plant, const MatrixRef& K) {
  FLYBALL_CHECK(check_system(plant, "closed_loop"));
  return close_loop(bare(plant), K).map([&](const Continuous& loop) {
    return detail::timed(loop, plant.period);
  });
}

Expected<Eigen::MatrixXcd> transfer_at(const Continuous& system, std::complex<double> s) {
  FLYBALL_CHECK(check_system_or_gain(system, "transfer_at"));
  return evaluate(system, s);
}
Expected<Eigen::MatrixXcd> transfer_at(const Discrete& system, std::complex<double> z) {
  FLYBALL_CHECK(check_system_or_gain(system, "transfer_at"));
  return evaluate(bare(system), z);
}

}  // namespace flyball
