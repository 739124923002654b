#include <cmath>
#include <numbers>

#include <flyball/systems/input_delay.hpp>

#include "control/sampled_loop.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace detail {

double spectral_radius(const Eigen::MatrixXd& M) {
  return M.size() == 0 ? 0.0 : eigenvalues_of(M).cwiseAbs().maxCoeff();
}

PlantInputLoop feedback_loop(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                             Time period, Time delay) {
  const Eigen::Index n = A.rows();
  return {A,
          B,
          Eigen::MatrixXd::Identity(n, n),
          period,
          delay,
          Eigen::MatrixXd(0, 0),
          Eigen::MatrixXd(0, n),
          Eigen::MatrixXd(K.rows(), 0),
          K};
}

PlantInputLoop observer_loop(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                             const DiscreteSystem<>& model, const MatrixRef& K,
                             const MatrixRef& K_e, Time delay) {
  // With the prediction q = x_hat⁻: x_hat = q + K_e (y - C q), u = -K x_hat, q⁺ = A x_hat + B u.
  const Eigen::Index n = model.A.rows();
  const Eigen::MatrixXd I_KC = Eigen::MatrixXd::Identity(n, n) - K_e * model.C;
  const Eigen::MatrixXd A_BK = model.A - model.B * K;
  return {A, B, C, model.period, delay, A_BK * I_KC, A_BK * K_e, K * I_KC, K * K_e};
}

Expected<void> check_delay(const PlantInputLoop& loop, std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .positive(loop.period.si(), "period", "s")
                    .not_negative(loop.delay.si(), "delay", "s"));
  if (loop.delay.si() > most_delay_periods * loop.period.si()) {
    return refusal(ArgumentError::out_of_range, where, "the delay")
        .got(format_number(loop.delay.si()) + " s")
        .expected(format_number(most_delay_periods) + " periods or less, " +
                  format_number(most_delay_periods * loop.period.si()) + " s");
  }
  return {};
}

Expected<void> check_loop(const PlantInputLoop& loop, std::string_view where) {
  FLYBALL_CHECK(check_square(loop.A, where, "A"));
  const Eigen::Index n = loop.A.rows();
  const Eigen::Index p = loop.C.rows();
  const Eigen::Index q = loop.A_c.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(loop.B, n, 1, "B", "states x 1")
                    .shape(loop.C, p, n, "C", "outputs x states")
                    .shape(loop.A_c, q, q, "A_c")
                    .shape(loop.B_c, q, p, "B_c")
                    .shape(loop.C_c, 1, q, "C_c")
                    .shape(loop.D_c, 1, p, "D_c", "1 x outputs"));
  return Checks(where)
      .finite(loop.A, "A")
      .finite(loop.B, "B")
      .finite(loop.C, "C")
      .finite(loop.A_c, "A_c")
      .finite(loop.B_c, "B_c")
      .finite(loop.C_c, "C_c")
      .finite(loop.D_c, "D_c")
      .also([&] { return check_delay(loop, where); });
}

Expected<SampledLoop> SampledLoop::create(const PlantInputLoop& loop, Time further_delay) {
  const Time delay(loop.delay.si() + further_delay.si());
  FLYBALL_TRY(auto parts, discretize_delayed_input(loop.A, loop.B, loop.period, delay));
  const Eigen::Index p = loop.C.rows();
  const ContinuousSystem<> plant{loop.A, loop.B, loop.C, Eigen::MatrixXd::Zero(p, loop.B.cols())};
  FLYBALL_TRY(auto delayed, discretize_with_input_delay(plant, loop.period, delay));
  SampledLoop sampled;
  sampled.A_ = std::move(parts.A);
  sampled.B_0_ = std::move(parts.B_0);
  sampled.B_1_ = std::move(parts.B_1);
  sampled.C_ = loop.C;
  sampled.whole_delays_ = parts.whole_periods;
  sampled.A_c_ = loop.A_c;
  sampled.B_c_ = loop.B_c;
  sampled.C_c_ = loop.C_c;
  sampled.D_c_ = loop.D_c;
  sampled.delayed_A_ = std::move(delayed.A);
  sampled.delayed_B_ = std::move(delayed.B);
  return sampled;
}

std::complex<double> SampledLoop::response(double theta) const {
  using Complex = std::complex<double>;
  // At the ends z is real, and so is L.
  const bool nyquist = theta >= std::numbers::pi;
  const Complex z = nyquist ? Complex(-1.0) : std::polar(1.0, theta);
  const Complex delay = nyquist ? Complex(std::fmod(whole_delays_, 2.0) == 0.0 ? 1.0 : -1.0)
                                : std::polar(1.0, -theta * whole_delays_);
  const auto resolvent = [&](const Eigen::MatrixXd& M, const Eigen::VectorXcd& right) {
    Eigen::MatrixXcd zI_M = -M.cast<Complex>();
    zI_M.diagonal().array() += z;
    return Eigen::VectorXcd(solve_complex(zI_M, right));
  };
  const auto times = [](const Eigen::MatrixXd& M, const Eigen::VectorXcd& right) {
    return Eigen::VectorXcd(M.cast<Complex>().lazyProduct(right));
  };
  const Eigen::VectorXcd u = B_0_.cast<Complex>() + B_1_.cast<Complex>() / z;
  const Eigen::VectorXcd y = times(C_, resolvent(A_, u));
  Complex v = times(D_c_, y)(0);
  if (A_c_.rows() > 0) {
    v += times(C_c_, resolvent(A_c_, times(B_c_, y)))(0);
  }
  return v * delay;
}

Expected<classical::FrequencyResponse> SampledLoop::open(Time period) const {
  const Eigen::Index n = A_.rows();
  const Eigen::Index q = A_c_.rows();
  const Eigen::Index before = B_1_.isZero(0.0) ? 0 : 1;  // the input of the last period
  DiscreteSystem<> L{Eigen::MatrixXd::Zero(n + before + q, n + before + q),
                     Eigen::MatrixXd::Zero(n + before + q, 1),
                     Eigen::MatrixXd::Zero(1, n + before + q), Eigen::MatrixXd::Zero(1, 1), period};
  L.A.topLeftCorner(n, n) = A_;
  L.B.topRows(n) = B_0_;
  if (before > 0) {
    L.A.block(0, n, n, 1) = B_1_;
    L.B(n, 0) = 1.0;
  }
  L.A.bottomLeftCorner(q, n) = B_c_ * C_;
  L.A.bottomRightCorner(q, q) = A_c_;
  L.C.leftCols(n) = D_c_ * C_;
  L.C.rightCols(q) = C_c_;
  return classical::frequency_response(L, Time(whole_delays_ * period.si()));
}

Eigen::MatrixXd SampledLoop::closed(double gain) const {
  const Eigen::Index n = A_.rows();
  const Eigen::Index n_delayed = delayed_A_.rows();
  const Eigen::Index q = A_c_.rows();
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n_delayed + q, n_delayed + q);
  M.topLeftCorner(n_delayed, n_delayed) = delayed_A_;
  M.topLeftCorner(n_delayed, n) -= gain * delayed_B_ * (D_c_ * C_);
  M.topRightCorner(n_delayed, q) = -gain * delayed_B_ * C_c_;
  M.bottomLeftCorner(q, n) = B_c_ * C_;
  M.bottomRightCorner(q, q) = A_c_;
  return M;
}

}  // namespace detail

Expected<PlantInputLoop> state_feedback_loop(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& K, Time period, Time delay) {
  constexpr std::string_view where = "state_feedback_loop";
  FLYBALL_CHECK(check_shape(K, 1, A.rows(), where, "K", "1 x states"));
  PlantInputLoop loop = detail::feedback_loop(A, B, K, period, delay);
  return detail::check_loop(loop, where).map([&] { return std::move(loop); });
}

Expected<PlantInputLoop> observer_regulator_loop(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& C, const DiscreteSystem<>& model,
                                                 const MatrixRef& K, const MatrixRef& K_e,
                                                 Time delay) {
  constexpr std::string_view where = "observer_regulator_loop";
  FLYBALL_CHECK(check_system(model, where));
  const Eigen::Index n = model.A.rows();
  const Eigen::Index p = model.C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(model.B, n, 1, "the model's B", "states x 1")
                    .shape(C, p, A.rows(), "C", "outputs x states")
                    .shape(K, 1, n, "K", "1 x states")
                    .shape(K_e, n, p, "K_e", "states x outputs"));
  if (!model.D.isZero(0.0)) {
    return refusal(ArgumentError::out_of_range, where, "the model's D")
        .got("not zero")
        .expected("zero: a measurement that contains the input closes a second loop");
  }
  PlantInputLoop loop = detail::observer_loop(A, B, C, model, K, K_e, delay);
  return detail::check_loop(loop, where).map([&] { return std::move(loop); });
}

Expected<double> closed_loop_radius(const PlantInputLoop& loop, double gain, Time further_delay) {
  constexpr std::string_view where = "closed_loop_radius";
  FLYBALL_CHECK(detail::check_loop(loop, where));
  FLYBALL_CHECK(
      Checks(where).finite(gain, "gain").not_negative(further_delay.si(), "further_delay", "s"));
  return detail::SampledLoop::create(loop, further_delay)
      .map([&](const detail::SampledLoop& sampled) {
        return detail::spectral_radius(sampled.closed(gain));
      });
}

Expected<std::complex<double>> loop_response(const PlantInputLoop& loop, double frequency) {
  constexpr std::string_view where = "loop_response";
  FLYBALL_CHECK(detail::check_loop(loop, where));
  FLYBALL_CHECK(check_not_negative(frequency, where, "frequency", "rad/s"));
  const double nyquist = std::numbers::pi / loop.period.si();
  if (frequency > nyquist * (1.0 + 1e-12)) {
    return refusal(ArgumentError::out_of_range, where, "frequency")
        .got(format_number(frequency) + " rad/s")
        .expected("at most the Nyquist frequency, " + format_number(nyquist) + " rad/s");
  }
  return detail::SampledLoop::create(loop).map([&](const detail::SampledLoop& sampled) {
    return sampled.response(frequency * loop.period.si());
  });
}

}  // namespace flyball
