#include <flyball/classical/delay_system.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/delay_parts.hpp"
#include "classical/polynomial.hpp"
#include "classical/whole_periods.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/balance.hpp"
#include "systems/zero_pole_gain.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using flyball::detail::product;

using detail::check_count;
using detail::diagonal;
using detail::period_text;
using detail::solve_loop;

namespace {

constexpr std::string_view noun = "delay system";
constexpr Index most_delay_states = 800;

Expected<void> check_form(const DelayForm& f) {
  const Index n = f.A.rows();
  const Index m = f.D11.cols();
  const Index p = f.D11.rows();
  const Index k = f.delays.size();
  if (m == 0 || p == 0) {
    return refusal(ArgumentError::empty, noun, "D11")
        .got("empty")
        .expected("outputs x inputs, one of each at least");
  }
  return Checks(noun)
      .shape(f.A, n, n, "A", "states x states")
      .shape(f.B1, n, m, "B1", "states x inputs")
      .shape(f.B2, n, k, "B2", "states x delays")
      .shape(f.C1, p, n, "C1", "outputs x states")
      .shape(f.C2, k, n, "C2", "delays x states")
      .shape(f.D12, p, k, "D12", "outputs x delays")
      .shape(f.D21, k, m, "D21", "delays x inputs")
      .shape(f.D22, k, k, "D22", "delays x delays")
      .finite(f.A, "A")
      .finite(f.B1, "B1")
      .finite(f.B2, "B2")
      .finite(f.C1, "C1")
      .finite(f.C2, "C2")
      .finite(f.D11, "D11")
      .finite(f.D12, "D12")
      .finite(f.D21, "D21")
      .finite(f.D22, "D22")
      .finite(MatrixXd(f.delays), "delays");
}

/// w = z for the delays that are zero, w = Δz for the others.
Expected<DelayForm> without_zero_delays(const DelayForm& f) {
  std::vector<Index> now;
  std::vector<Index> later;
  for (Index i = 0; i < f.delays.size(); ++i) {
    (f.delays(i) == 0.0 ? now : later).push_back(i);
  }
  if (now.empty()) {
    return f;
  }
  // w₀ = C₀x + D₀₁u + D₀w₀ + D₀₂w: (I - D₀) w₀ = [C₀ D₀₁ D₀₂][x; u; w].
  const Index n = f.A.rows();
  const Index m = f.D11.cols();
  const Index k = static_cast<Index>(later.size());
  MatrixXd right(static_cast<Index>(now.size()), n + m + k);
  right << f.C2(now, Eigen::all), f.D21(now, Eigen::all), f.D22(now, later);
  FLYBALL_TRY(const MatrixXd w0, solve_loop(f.D22(now, now), right, noun, "I - D22 without delay"));
  const auto x = w0.leftCols(n);
  const auto u = w0.middleCols(n, m);
  const auto w = w0.rightCols(k);
  const MatrixXd B0 = f.B2(Eigen::all, now);
  const MatrixXd D10 = f.D12(Eigen::all, now);
  const MatrixXd D20 = f.D22(later, now);
  return DelayForm{f.A + product(B0, x),
                   f.B1 + product(B0, u),
                   f.B2(Eigen::all, later) + product(B0, w),
                   f.C1 + product(D10, x),
                   f.C2(later, Eigen::all) + product(D20, x),
                   f.D11 + product(D10, u),
                   f.D12(Eigen::all, later) + product(D10, w),
                   f.D21(later, Eigen::all) + product(D20, u),
                   f.D22(later, later) + product(D20, w),
                   f.delays(later)};
}

DelayForm without_delays(const ContinuousSystem<>& s) {
  const Index n = s.A.rows();
  const Index m = s.D.cols();
  const Index p = s.D.rows();
  return {s.A,
          s.B,
          MatrixXd::Zero(n, 0),
          s.C,
          MatrixXd::Zero(0, n),
          s.D,
          MatrixXd::Zero(p, 0),
          MatrixXd::Zero(0, m),
          MatrixXd::Zero(0, 0),
          VectorXd(0)};
}

/// By its roots where they are found.
ContinuousSystem<> in_sections(const TransferFunction& G) {
  const auto zeros = G.zeros();
  const auto poles = G.poles();
  if (!zeros || !poles || G.is_zero()) {
    return G.to_state_space();
  }
  flyball::detail::ZeroPoleGain zpk;
  zpk.zeros.assign(zeros->begin(), zeros->end());
  zpk.poles.assign(poles->begin(), poles->end());
  zpk.gain = G.num()(0) / G.den()(0);
  auto chain = flyball::detail::series_of_sections(zpk);
  const bool finite = chain.A.allFinite() && chain.B.allFinite() && chain.C.allFinite();
  if (!finite || !std::isfinite(zpk.gain) || zpk.gain == 0.0) {
    return G.to_state_space();
  }
  // States of like size, as they are solved for.
  return flyball::detail::scaled_system(chain,
                                        flyball::detail::scaling_of(chain.A, chain.B, chain.C));
}

/// A Padé approximation of e^{-τs} as a realisation of its own.
Expected<ContinuousSystem<>> approximated(double delay, int order) {
  FLYBALL_TRY(const auto P, pade(Time(delay), order));
  return in_sections(P);
}

}  // namespace

Expected<DelaySystem> DelaySystem::create(const DelayForm& form, std::optional<Time> period) {
  FLYBALL_CHECK(check_form(form));
  if (period) {
    FLYBALL_CHECK(check_positive(period->si(), noun, "period", "s"));
  }
  for (Index i = 0; i < form.delays.size(); ++i) {
    const double delay = form.delays(i);
    FLYBALL_CHECK(check_not_negative(delay, noun, "delay", "s"));
    FLYBALL_CHECK(detail::check_whole_periods(delay, period, noun, "a discrete system"));
  }
  FLYBALL_TRY(DelayForm closed, without_zero_delays(form));
  if (period) {
    closed.delays = (closed.delays / period->si()).array().round() * period->si();
  }
  return DelaySystem(std::move(closed), period);
}

Expected<DelaySystem> DelaySystem::create(const ContinuousSystem<>& system) {
  FLYBALL_CHECK(check_system_or_gain(system, noun));
  return create(without_delays(system));
}

Expected<DelaySystem> DelaySystem::create(const DiscreteSystem<>& system) {
  FLYBALL_CHECK(check_system_or_gain(system, noun));
  return create(without_delays({system.A, system.B, system.C, system.D}), system.period);
}

Expected<DelaySystem> DelaySystem::create(const TransferFunction& transfer) {
  constexpr Index most = 200;
  if (transfer.order() > most) {
    return refusal(ArgumentError::out_of_range, noun, "the order")
        .got(std::to_string(transfer.order()))
        .expected(flyball::detail::format("at most {}", most));
  }
  const DelaySystem rational(without_delays(in_sections(transfer)), transfer.period());
  return rational.with_input_delays(VectorXd::Constant(1, transfer.delay()));
}

Expected<DelaySystem> DelaySystem::gain(const MatrixRef& M, std::optional<Time> period) {
  return create(without_delays({MatrixXd(0, 0), MatrixXd(0, M.cols()), MatrixXd(M.rows(), 0), M}),
                period);
}

bool DelaySystem::has_delay_in_loop() const {
  // Which delay's z its w reaches: through D₂₂, or through states that drive each other.
  const Index n = states();
  const Index k = delays().size();
  Eigen::MatrixXi reach = Eigen::MatrixXi::Zero(n + k, n + k);
  const auto mark = [](const MatrixXd& M) { return (M.array() != 0.0).cast<int>().matrix(); };
  reach.topLeftCorner(n, n) = mark(form_.A);
  reach.topRightCorner(n, k) = mark(form_.B2);
  reach.bottomLeftCorner(k, n) = mark(form_.C2);
  reach.bottomRightCorner(k, k) = mark(form_.D22);
  for (Index via = 0; via < n + k; ++via) {
    for (Index i = 0; i < n + k; ++i) {
      if (reach(i, via) != 0) {
        reach.row(i) = reach.row(i).cwiseMax(reach.row(via));
      }
    }
  }
  return k > 0 && reach.bottomRightCorner(k, k).diagonal().any();
}

Expected<DelaySystem> DelaySystem::with_input_delays(const VectorXd& further) const {
  const Index m = inputs();
  const Index n = states();
  const Index k = delays().size();
  FLYBALL_CHECK(
      check_count(further.size(), m, noun, "the number of input delays", "one for each input"));
  // u' is what is delayed, w' what the system gets.
  DelayForm f;
  f.A = form_.A;
  f.B1 = MatrixXd::Zero(n, m);
  f.B2.resize(n, k + m);
  f.B2 << form_.B2, form_.B1;
  f.C1 = form_.C1;
  f.C2.resize(k + m, n);
  f.C2 << form_.C2, MatrixXd::Zero(m, n);
  f.D11 = MatrixXd::Zero(outputs(), m);
  f.D12.resize(outputs(), k + m);
  f.D12 << form_.D12, form_.D11;
  f.D21.resize(k + m, m);
  f.D21 << MatrixXd::Zero(k, m), MatrixXd::Identity(m, m);
  f.D22 = MatrixXd::Zero(k + m, k + m);
  f.D22.topLeftCorner(k, k) = form_.D22;
  f.D22.topRightCorner(k, m) = form_.D21;
  f.delays.resize(k + m);
  f.delays << delays(), further;
  return create(f, period_);
}

Expected<DelaySystem> DelaySystem::with_output_delays(const VectorXd& further) const {
  const Index m = inputs();
  const Index p = outputs();
  const Index n = states();
  const Index k = delays().size();
  FLYBALL_CHECK(
      check_count(further.size(), p, noun, "the number of output delays", "one for each output"));
  DelayForm f;
  f.A = form_.A;
  f.B1 = form_.B1;
  f.B2.resize(n, k + p);
  f.B2 << form_.B2, MatrixXd::Zero(n, p);
  f.C1 = MatrixXd::Zero(p, n);
  f.C2.resize(k + p, n);
  f.C2 << form_.C2, form_.C1;
  f.D11 = MatrixXd::Zero(p, m);
  f.D12.resize(p, k + p);
  f.D12 << MatrixXd::Zero(p, k), MatrixXd::Identity(p, p);
  f.D21.resize(k + p, m);
  f.D21 << form_.D21, form_.D11;
  f.D22 = MatrixXd::Zero(k + p, k + p);
  f.D22.topLeftCorner(k, k) = form_.D22;
  f.D22.bottomLeftCorner(p, k) = form_.D12;
  f.delays.resize(k + p);
  f.delays << delays(), further;
  return create(f, period_);
}

Expected<DelaySystem> DelaySystem::channels(const std::vector<Index>& outputs_wanted,
                                            const std::vector<Index>& inputs_wanted) const {
  for (const auto& [wanted, count, name] :
       {std::tuple{&outputs_wanted, outputs(), "output"}, {&inputs_wanted, inputs(), "input"}}) {
    if (wanted->empty()) {
      return refusal(ArgumentError::empty, noun, flyball::detail::format("the list of {}s", name))
          .got("empty");
    }
    for (const Index i : *wanted) {
      FLYBALL_CHECK(
          check_within(static_cast<double>(i), 0.0, static_cast<double>(count - 1), noun, name));
    }
  }
  DelayForm f = form_;
  f.B1 = form_.B1(Eigen::all, inputs_wanted);
  f.C1 = form_.C1(outputs_wanted, Eigen::all);
  f.D11 = form_.D11(outputs_wanted, inputs_wanted);
  f.D12 = form_.D12(outputs_wanted, Eigen::all);
  f.D21 = form_.D21(Eigen::all, inputs_wanted);
  return DelaySystem(std::move(f), period_);
}

namespace {

/// G at a point where the delays are those factors: one system of equations in x and z,
/// (sI - A) x = B₁u + B₂Δz, z = C₂x + D₂₁u + D₂₂Δz.
MatrixXcd solve_at(const DelayForm& f, Complex point, const Eigen::VectorXcd& late,
                   double* rcond = nullptr) {
  const Index n = f.A.rows();
  const Index k = f.delays.size();
  if (n + k == 0) {
    if (rcond != nullptr) {
      *rcond = 1.0;
    }
    return f.D11.cast<Complex>();
  }
  MatrixXcd M(n + k, n + k);
  M.topLeftCorner(n, n) = -f.A.cast<Complex>();
  M.topLeftCorner(n, n).diagonal().array() += point;
  M.topRightCorner(n, k) = -f.B2.cast<Complex>() * late.asDiagonal();
  M.bottomLeftCorner(k, n) = -f.C2.cast<Complex>();
  M.bottomRightCorner(k, k) = -f.D22.cast<Complex>() * late.asDiagonal();
  M.bottomRightCorner(k, k).diagonal().array() += 1.0;
  MatrixXcd right(n + k, f.D11.cols());
  right << f.B1.cast<Complex>(), f.D21.cast<Complex>();
  const MatrixXcd xz = flyball::detail::solve_complex(M, right, rcond);
  MatrixXcd seen(f.D11.rows(), n + k);
  seen << f.C1.cast<Complex>(), f.D12.cast<Complex>() * late.asDiagonal();
  return flyball::detail::complex_product(seen, xz) + f.D11.cast<Complex>();
}

}  // namespace

Expected<MatrixXcd> DelaySystem::at(Complex s) const {
  FLYBALL_CHECK(Checks(noun).finite(s.real(), "the point").finite(s.imag(), "the point"));
  Eigen::VectorXcd late(delays().size());
  for (Index i = 0; i < late.size(); ++i) {
    late(i) = period_ ? std::pow(s, -static_cast<double>(detail::periods_in(delays()(i), period_)))
                      : std::exp(-s * delays()(i));
  }
  double rcond = 0.0;
  MatrixXcd G = solve_at(form_, s, late, &rcond);
  if (rcond == 0.0 || !G.allFinite()) {
    return refusal(TransferError::at_a_pole, noun, "the point")
        .got("a pole")
        .with("point", std::vector<double>{s.real(), s.imag()});
  }
  return G;
}

MatrixXcd DelaySystem::response(double frequency) const {
  const Complex point =
      period_ ? std::polar(1.0, frequency * period_->si()) : Complex(0.0, frequency);
  Eigen::VectorXcd late(delays().size());
  for (Index i = 0; i < late.size(); ++i) {
    late(i) = std::polar(1.0, -frequency * delays()(i));
  }
  return solve_at(form_, point, late);
}

MatrixXd DelaySystem::dc_gain() const {
  return response(0.0).real();
}

Expected<ContinuousSystem<>> DelaySystem::to_continuous() const {
  if (period_) {
    return refusal(TransferError::period_mismatch, noun, "the sample period")
        .got(period_text(period_))
        .expected("continuous");
  }
  if (has_delay()) {
    return refusal(TransferError::delay_in_loop, noun, "the longest delay")
        .got(flyball::detail::format("{} s", delays().maxCoeff()))
        .expected("none, or a rational approximation of them (`pade`)");
  }
  return ContinuousSystem<>{form_.A, form_.B1, form_.C1, form_.D11};
}

Expected<DiscreteSystem<>> DelaySystem::to_discrete() const {
  if (!period_) {
    return refusal(TransferError::period_mismatch, noun, "the system")
        .got("continuous")
        .expected("discrete");
  }
  const Index n = states();
  const Index k = delays().size();
  std::vector<Index> lengths;
  double total = static_cast<double>(n);
  for (Index i = 0; i < k; ++i) {
    total += static_cast<double>(detail::periods_in(delays()(i), period_));
    lengths.push_back(static_cast<Index>(total));
  }
  if (total > static_cast<double>(most_delay_states)) {
    return refusal(ArgumentError::out_of_range, noun, "the number of states with the delays'")
        .got(flyball::detail::format("{}", total))
        .expected(flyball::detail::format("at most {}", most_delay_states))
        .hint("sample it more slowly");
  }
  // A line of states for each delay: the first takes z, the last is w.
  const auto size = static_cast<Index>(total);
  MatrixXd W = MatrixXd::Zero(k, size);
  DiscreteSystem<> s{MatrixXd::Zero(size, size), MatrixXd::Zero(size, inputs()),
                     MatrixXd::Zero(outputs(), size), form_.D11, *period_};
  for (Index i = 0; i < k; ++i) {
    W(i, lengths[static_cast<std::size_t>(i)] - 1) = 1.0;
  }
  s.A.topLeftCorner(n, n) = form_.A;
  s.A.topRows(n) += product(form_.B2, W);
  s.B.topRows(n) = form_.B1;
  s.C.leftCols(n) = form_.C1;
  s.C += product(form_.D12, W);
  const MatrixXd z_w = product(form_.D22, W);
  for (Index i = 0; i < k; ++i) {
    const Index first = i == 0 ? n : lengths[static_cast<std::size_t>(i - 1)];
    const Index end = lengths[static_cast<std::size_t>(i)];
    s.A.row(first).head(n) = form_.C2.row(i);
    s.A.row(first) += z_w.row(i);
    s.B.row(first) = form_.D21.row(i);
    for (Index j = first + 1; j < end; ++j) {
      s.A(j, j - 1) = 1.0;
    }
  }
  return s;
}

Expected<ContinuousSystem<>> DelaySystem::pade(int order) const {
  if (period_) {
    return to_continuous();
  }
  // [G of u and w] with w led back from z through the approximations.
  ContinuousSystem<> lines{MatrixXd(0, 0), MatrixXd(0, 0), MatrixXd(0, 0), MatrixXd(0, 0)};
  for (Index i = 0; i < delays().size(); ++i) {
    FLYBALL_TRY(const auto line, approximated(delays()(i), order));
    lines = {diagonal(lines.A, line.A), diagonal(lines.B, line.B), diagonal(lines.C, line.C),
             diagonal(lines.D, line.D)};
  }
  DelayForm f = form_;
  const Index q = lines.A.rows();
  // w = C_l x_l + D_l z, of which D_l z is a delay of zero.
  const MatrixXd w = lines.C;
  f.A = diagonal(form_.A, lines.A);
  f.A.topRightCorner(states(), q) = product(form_.B2, w);
  f.A.bottomLeftCorner(q, states()) = product(lines.B, form_.C2);
  f.A.bottomRightCorner(q, q) += product(lines.B, product(form_.D22, w));
  f.B1.resize(states() + q, inputs());
  f.B1 << form_.B1, product(lines.B, form_.D21);
  f.B2.resize(states() + q, delays().size());
  f.B2 << form_.B2, product(lines.B, form_.D22);
  f.B2 = product(f.B2, lines.D);
  f.C1.resize(outputs(), states() + q);
  f.C1 << form_.C1, product(form_.D12, w);
  f.C2.resize(delays().size(), states() + q);
  f.C2 << form_.C2, product(form_.D22, w);
  f.D12 = product(form_.D12, lines.D);
  f.D22 = product(form_.D22, lines.D);
  f.delays.setZero();
  FLYBALL_TRY(const DelaySystem rational, create(f));
  return rational.to_continuous();
}

}  // namespace flyball::classical
