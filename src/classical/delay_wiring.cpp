#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <flyball/classical/delay_system.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/delay_parts.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/algebraic_loop.hpp"
#include "systems/balance.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::detail::product;

namespace detail {

MatrixXd diagonal(const MatrixXd& first, const MatrixXd& second) {
  MatrixXd both = MatrixXd::Zero(first.rows() + second.rows(), first.cols() + second.cols());
  both.topLeftCorner(first.rows(), first.cols()) = first;
  both.bottomRightCorner(second.rows(), second.cols()) = second;
  return both;
}

std::string period_text(const std::optional<Time>& period) {
  return period ? flyball::detail::format("{} s", period->si()) : std::string("continuous");
}

Expected<void> check_count(Index got, Index expected, std::string_view where,
                           std::string_view subject, std::string_view of) {
  if (got == expected) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, where, subject)
      .got(std::to_string(got))
      .expected(flyball::detail::format("{}, {}", expected, of));
}

Expected<MatrixXd> solve_loop(const MatrixXd& L, const MatrixXd& R, std::string_view where,
                              std::string_view subject) {
  return flyball::detail::solve_algebraic_loop(
      {L, MatrixXd(), -1.0, subject,
       "give one of the paths dynamics or dead time: no loop acts instantly"},
      R, where);
}

}  // namespace detail

using detail::check_count;
using detail::diagonal;
using detail::period_text;
using detail::solve_loop;

namespace {

Expected<void> check_periods(const DelaySystem& first, const DelaySystem& second,
                             std::string_view where) {
  const auto& a = first.period();
  const auto& b = second.period();
  if (a.has_value() == b.has_value() && (!a || std::abs(a->si() - b->si()) <= 1e-12 * a->si())) {
    return {};
  }
  return refusal(TransferError::period_mismatch, where, "the second's sample period")
      .got(period_text(b))
      .expected(period_text(a) + ", the first's")
      .hint("discretize or resample one of them");
}

}  // namespace

Expected<DelaySystem> append(const DelaySystem& first, const DelaySystem& second) {
  FLYBALL_CHECK(check_periods(first, second, "append"));
  const DelayForm& a = first.form();
  const DelayForm& b = second.form();
  VectorXd delays(a.delays.size() + b.delays.size());
  delays << a.delays, b.delays;
  return DelaySystem::create(
      DelayForm{diagonal(a.A, b.A), diagonal(a.B1, b.B1), diagonal(a.B2, b.B2),
                diagonal(a.C1, b.C1), diagonal(a.C2, b.C2), diagonal(a.D11, b.D11),
                diagonal(a.D12, b.D12), diagonal(a.D21, b.D21), diagonal(a.D22, b.D22), delays},
      first.period());
}

namespace {

Expected<DelaySystem> rewired_as(const DelaySystem& system, const Wiring& wiring,
                                 std::string_view where, std::string_view loop) {
  const DelayForm& f = system.form();
  const Index m = system.inputs();
  const Index p = system.outputs();
  const Index r = wiring.E.cols();
  const Index q = wiring.H.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(wiring.F, m, p, "F", "inputs x outputs")
                    .shape(wiring.E, m, r, "E", "inputs x new inputs")
                    .shape(wiring.H, q, p, "H", "new outputs x outputs")
                    .shape(wiring.J, q, r, "J", "new outputs x new inputs")
                    .finite(wiring.F, "F")
                    .finite(wiring.E, "E")
                    .finite(wiring.H, "H")
                    .finite(wiring.J, "J"));
  // u = F (C₁x + D₁₁u + D₁₂w) + E r: (I - F D₁₁) u = [F C₁, F D₁₂, E][x; w; r].
  const Index n = system.states();
  const Index k = system.delays().size();
  MatrixXd right(m, n + k + r);
  right << product(wiring.F, f.C1), product(wiring.F, f.D12), wiring.E;
  FLYBALL_TRY(const MatrixXd u, solve_loop(product(wiring.F, f.D11), right, where, loop));
  const auto x = u.leftCols(n);
  const auto w = u.middleCols(n, k);
  const auto e = u.rightCols(r);
  return DelaySystem::create(
      DelayForm{f.A + product(f.B1, x), product(f.B1, e), f.B2 + product(f.B1, w),
                product(wiring.H, f.C1 + product(f.D11, x)), f.C2 + product(f.D21, x),
                product(wiring.H, product(f.D11, e)) + wiring.J,
                product(wiring.H, f.D12 + product(f.D11, w)), product(f.D21, e),
                f.D22 + product(f.D21, w), f.delays},
      system.period());
}

}  // namespace

Expected<DelaySystem> rewired(const DelaySystem& system, const Wiring& wiring) {
  return rewired_as(system, wiring, "rewired", "I - F D11");
}

Expected<DelaySystem> series(const DelaySystem& first, const DelaySystem& second) {
  constexpr std::string_view where = "series";
  FLYBALL_CHECK(check_periods(first, second, where));
  FLYBALL_CHECK(check_count(second.inputs(), first.outputs(), where,
                            "the number of the second's inputs", "the first's outputs"));
  FLYBALL_TRY(const DelaySystem both, append(first, second));
  const Index m = first.inputs();
  const Index link = first.outputs();
  const Index p = second.outputs();
  Wiring wiring{MatrixXd::Zero(m + link, link + p), MatrixXd::Zero(m + link, m),
                MatrixXd::Zero(p, link + p), MatrixXd::Zero(p, m)};
  wiring.F.block(m, 0, link, link).setIdentity();
  wiring.E.topRows(m).setIdentity();
  wiring.H.rightCols(p).setIdentity();
  return rewired_as(both, wiring, where, "the chain");
}

Expected<DelaySystem> parallel(const DelaySystem& first, const DelaySystem& second) {
  constexpr std::string_view where = "parallel";
  FLYBALL_CHECK(check_periods(first, second, where));
  FLYBALL_CHECK(check_count(second.inputs(), first.inputs(), where,
                            "the number of the second's inputs", "as the first has"));
  FLYBALL_CHECK(check_count(second.outputs(), first.outputs(), where,
                            "the number of the second's outputs", "as the first has"));
  FLYBALL_TRY(const DelaySystem both, append(first, second));
  const Index m = first.inputs();
  const Index p = first.outputs();
  Wiring wiring{MatrixXd::Zero(2 * m, 2 * p), MatrixXd(2 * m, m), MatrixXd(p, 2 * p),
                MatrixXd::Zero(p, m)};
  wiring.E << MatrixXd::Identity(m, m), MatrixXd::Identity(m, m);
  wiring.H << MatrixXd::Identity(p, p), MatrixXd::Identity(p, p);
  return rewired_as(both, wiring, where, "the sum");
}

Expected<DelaySystem> feedback(const DelaySystem& forward, const DelaySystem& back,
                               FeedbackSign sign) {
  constexpr std::string_view where = "feedback";
  FLYBALL_CHECK(check_periods(forward, back, where));
  FLYBALL_CHECK(check_count(back.inputs(), forward.outputs(), where,
                            "the number of the feedback path's inputs", "the forward's outputs"));
  FLYBALL_CHECK(check_count(back.outputs(), forward.inputs(), where,
                            "the number of the feedback path's outputs", "the forward's inputs"));
  FLYBALL_TRY(const DelaySystem both, append(forward, back));
  const Index m = forward.inputs();
  const Index p = forward.outputs();
  const double s = sign == FeedbackSign::negative ? -1.0 : 1.0;
  Wiring wiring{MatrixXd::Zero(m + p, p + m), MatrixXd::Zero(m + p, m), MatrixXd::Zero(p, p + m),
                MatrixXd::Zero(p, m)};
  wiring.F.topRightCorner(m, m) = s * MatrixXd::Identity(m, m);
  wiring.F.bottomLeftCorner(p, p).setIdentity();
  wiring.E.topRows(m).setIdentity();
  wiring.H.leftCols(p).setIdentity();
  return rewired_as(both, wiring, where, s < 0.0 ? "I + D1 D2" : "I - D1 D2");
}

Expected<DelaySystem> feedback(const DelaySystem& forward, FeedbackSign sign) {
  constexpr std::string_view where = "feedback";
  const Index m = forward.inputs();
  FLYBALL_CHECK(
      check_count(forward.outputs(), m, where, "the number of outputs", "as there are inputs"));
  const MatrixXd one = MatrixXd::Identity(m, m);
  return rewired_as(
      forward, Wiring{sign == FeedbackSign::negative ? MatrixXd(-one) : one, one, one, 0.0 * one},
      where, sign == FeedbackSign::negative ? "I + D" : "I - D");
}

}  // namespace flyball::classical
