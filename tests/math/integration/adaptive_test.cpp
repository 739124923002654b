#include <flyball/math/integration/adaptive.hpp>

#include <cmath>
#include <numbers>

#include <flyball/core/argument.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/integration/fixed_step.hpp>

namespace flyball::adaptive_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

const auto oscillator = [](double, const Vector2d& x) { return Vector2d(x(1), -x(0)); };

IntegrationOptions accurate(double tolerance,
                            IntegrationMethod method = IntegrationMethod::automatic) {
  return {.method = method, .relative_tolerance = tolerance, .absolute_tolerance = tolerance};
}

/// x'' = 1000 (1 - x²) x' - x over a generic scalar.
const auto van_der_pol = [](double, const auto& x) {
  using Scalar = typename std::decay_t<decltype(x)>::Scalar;
  return Eigen::Vector<Scalar, 2>{x(1), 1000.0 * (1.0 - x(0) * x(0)) * x(1) - x(0)};
};

TEST(AdaptiveIntegration, OscillatorOverManyPeriods) {
  for (const auto method : {IntegrationMethod::dormand_prince, IntegrationMethod::radau}) {
    const auto solution =
        integrate(oscillator, 0.0, Vector2d(1.0, 0.0), 20.0 * pi, accurate(1e-11, method)).value();
    EXPECT_EQ(solution.final_time(), 20.0 * pi);
    EXPECT_NEAR(solution.final_state()(0), 1.0, 3e-9);
    EXPECT_NEAR(solution.final_state()(1), 0.0, 3e-9);
  }
}

// The book's Snippet 7.2 overwrites the step before it is added to the time: with h = 0.5 it gave
// 0.97239 for cos(0.5).
TEST(AdaptiveIntegration, TheStepIsAddedToTheTimeThatItWasTaken) {
  IntegrationOptions options = accurate(1e-12);
  options.initial_step = 0.5;
  const auto solution = integrate(oscillator, 0.0, Vector2d(1.0, 0.0), 0.5, options).value();
  EXPECT_NEAR(solution.final_state()(0), std::cos(0.5), 1e-12);
  EXPECT_GT(solution.statistics().rejected, 0);
}

TEST(AdaptiveIntegration, LinearSystemsAgreeWithTheirExponential) {
  {
    const bool holds = rc::check("dx/dt = A x + B u, slow and stiff", [] {
      const auto entry = [] { return *rc::gen::inRange(-1000, 1000) / 500.0; };
      Eigen::Matrix3d A;
      for (Eigen::Index i = 0; i < A.size(); ++i) {
        A(i) = entry();
      }
      A.row(2) *= *rc::gen::element(1.0, 30.0, 1000.0);
      A.diagonal().array() -=
          A.cwiseAbs().rowwise().sum().array();  // stable, by Gershgorin's discs
      const Vector3d B(entry(), entry(), entry());
      const Vector3d x(entry(), entry(), entry());
      const Vector3d exact = integrate_linear(A, B, x, Eigen::VectorXd::Ones(1), 2.0).value();
      for (const auto method : {IntegrationMethod::automatic, IntegrationMethod::radau}) {
        const auto f = [&](double, const Vector3d& at) { return Vector3d(A * at + B); };
        const auto solution = integrate(f, 0.0, x, 2.0, accurate(1e-9, method)).value();
        RC_ASSERT((solution.final_state() - exact).norm() < 1e-6);
      }
    });
    EXPECT_TRUE(holds);
  }
}

// One revolution with eccentricity 0.9, whose speed varies nineteenfold: back at perihelion.
TEST(AdaptiveIntegration, KeplerOrbit) {
  const auto kepler = [](double, const Eigen::Vector4d& x) {
    const double r3 = std::pow(x.head<2>().norm(), 3);
    return Eigen::Vector4d(x(2), x(3), -x(0) / r3, -x(1) / r3);
  };
  constexpr double e = 0.9;
  const Eigen::Vector4d start(1.0 - e, 0.0, 0.0, std::sqrt((1.0 + e) / (1.0 - e)));
  const auto solution = integrate(kepler, 0.0, start, 2.0 * pi, accurate(1e-12)).value();
  EXPECT_LT((solution.final_state() - start).norm(), 2e-8);
  const auto energy = [](const Eigen::VectorXd& x) {
    return 0.5 * x.tail<2>().squaredNorm() - 1.0 / x.head<2>().norm();
  };
  EXPECT_NEAR(energy(solution.final_state()), -0.5, 1e-9);
  EXPECT_TRUE(std::isnan(solution.statistics().stiff_from));
}

// x = 1/(1 + 9 e^-t).
TEST(AdaptiveIntegration, LogisticGrowthAndDenseOutput) {
  const auto logistic = [](double, const Eigen::Vector<double, 1>& x) {
    return Eigen::Vector<double, 1>(x(0) * (1.0 - x(0)));
  };
  for (const auto method : {IntegrationMethod::dormand_prince, IntegrationMethod::radau}) {
    const auto solution =
        integrate(logistic, 0.0, Eigen::Vector<double, 1>(0.1), 10.0, accurate(1e-10, method))
            .value();
    double worst = 0.0;
    for (double t = 0.0; t <= 10.0; t += 0.01) {
      worst = std::max(worst, std::abs(solution.at(t)(0) - 1.0 / (1.0 + 9.0 * std::exp(-t))));
    }
    EXPECT_LT(worst, method == IntegrationMethod::radau ? 2e-6 : 1e-8);
    EXPECT_EQ(solution.at(-1.0)(0), 0.1);
    EXPECT_EQ(solution.at(11.0), solution.final_state());
    EXPECT_EQ(solution.states().cols(), static_cast<Eigen::Index>(solution.times().size()));
  }
}

// The extension of Dormand-Prince is of order 4 in the step: halving the steps divides its error by
// 2⁵ (local) where the steps' own is negligible.
TEST(AdaptiveIntegration, OrderOfTheContinuousExtension) {
  const auto error = [](double h, IntegrationMethod method) {
    IntegrationOptions options = accurate(1e-3, method);
    options.initial_step = h;
    options.max_step = h;
    const auto solution = integrate(oscillator, 0.0, Vector2d(1.0, 0.0), h, options).value();
    double worst = 0.0;
    for (double s = 0.0; s <= 1.0; s += 0.05) {
      const Vector2d exact(std::cos(s * h), -std::sin(s * h));
      worst = std::max(worst, (solution.at(s * h) - exact).norm());
    }
    return worst;
  };
  EXPECT_NEAR(std::log2(error(0.2, IntegrationMethod::dormand_prince) /
                        error(0.1, IntegrationMethod::dormand_prince)),
              5.0, 0.3);
  EXPECT_NEAR(
      std::log2(error(0.2, IntegrationMethod::radau) / error(0.1, IntegrationMethod::radau)), 4.0,
      0.4);
}

TEST(AdaptiveIntegration, ErrorFollowsTheTolerance) {
  double previous = 1.0;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const auto solution =
        integrate(oscillator, 0.0, Vector2d(1.0, 0.0), 10.0, accurate(tolerance)).value();
    const double error =
        (solution.final_state() - Vector2d(std::cos(10.0), -std::sin(10.0))).norm();
    EXPECT_LT(error, 30.0 * tolerance);
    EXPECT_LT(error, 0.1 * previous);
    previous = error;
  }
}

// scipy.integrate.solve_ivp(f, (0, 2000), [2, 0], "Radau", rtol=1e-12, atol=1e-14, jac=J),
// SciPy 1.10.1: 1.7061677321705073, -8.9280970102477159e-04; its rtol=1e-6, atol=1e-9 took 862
// points, 7202 calls and 584 factorisations.
TEST(AdaptiveIntegration, StiffVanDerPolAgreesWithSciPy) {
  for (const auto method : {IntegrationMethod::automatic, IntegrationMethod::radau}) {
    const auto tight =
        integrate(van_der_pol, 0.0, Vector2d(2.0, 0.0), 2000.0,
                  {.method = method, .relative_tolerance = 1e-10, .absolute_tolerance = 1e-12})
            .value();
    EXPECT_NEAR(tight.final_state()(0), 1.7061677321705073, 1e-9);
    EXPECT_NEAR(tight.final_state()(1), -8.9280970102477159e-04, 1e-12);
    const auto loose = integrate(with_exact_jacobian(van_der_pol), 0.0, Vector2d(2.0, 0.0), 2000.0,
                                 {.method = method})
                           .value();
    EXPECT_NEAR(loose.final_state()(0), 1.7061677321705073, 1e-6);
    EXPECT_LT(loose.statistics().steps, 1000);
    EXPECT_LT(loose.statistics().evaluations, 10000);
    EXPECT_LT(loose.statistics().stiff_from, 1.0);
  }
}

// SciPy as above for t in (0, 40), rtol=1e-12, atol=1e-14.
TEST(AdaptiveIntegration, StiffRobertsonKinetics) {
  const auto robertson = [](double, const Vector3d& x) {
    const double slow = 0.04 * x(0);
    const double back = 1e4 * x(1) * x(2);
    const double fast = 3e7 * x(1) * x(1);
    return Vector3d(back - slow, slow - back - fast, fast);
  };
  const auto solution = integrate(robertson, 0.0, Vector3d(1.0, 0.0, 0.0), 40.0,
                                  {.relative_tolerance = 1e-9, .absolute_tolerance = 1e-13})
                            .value();
  EXPECT_NEAR(solution.final_state()(0), 7.1582706871990653e-01, 1e-8);
  EXPECT_NEAR(solution.final_state()(1), 9.1855347645783336e-06, 1e-12);
  EXPECT_NEAR(solution.final_state()(2), 2.8416374574532755e-01, 1e-8);
  EXPECT_LT(solution.statistics().stiff_from, 10.0);
  EXPECT_NEAR(solution.final_state().sum(), 1.0, 1e-10);
}

// scipy.integrate.solve_ivp(lorenz, (0, 2), [1, 1, 1], "DOP853", rtol=1e-13, atol=1e-14); its RK45
// at rtol=1e-6, atol=1e-9 takes 488 calls for an error of 7e-5.
TEST(AdaptiveIntegration, LorenzAgreesWithSciPy) {
  const auto lorenz = [](double, const Vector3d& x) {
    return Vector3d(10.0 * (x(1) - x(0)), x(0) * (28.0 - x(2)) - x(1),
                    x(0) * x(1) - 8.0 / 3.0 * x(2));
  };
  const Vector3d expected(-8.173499932241866, -9.562023686798701, 24.620702049678908);
  const auto tight = integrate(lorenz, 0.0, Vector3d(1.0, 1.0, 1.0), 2.0, accurate(1e-12)).value();
  EXPECT_LT((tight.final_state() - expected).norm(), 1e-9);
  const auto loose = integrate(lorenz, 0.0, Vector3d(1.0, 1.0, 1.0), 2.0).value();
  EXPECT_LT((loose.final_state() - expected).norm(), 2e-4);
  EXPECT_LT(loose.statistics().evaluations, 700);
}

TEST(AdaptiveIntegration, BackwardReturnsToTheStart) {
  for (const auto method : {IntegrationMethod::dormand_prince, IntegrationMethod::radau}) {
    const auto timed = [](double t, const Vector2d& x) {
      return Vector2d(x(1) + std::cos(t), -std::sin(x(0)));
    };
    const Vector2d start(0.3, -0.2);
    const auto forth = integrate(timed, 1.0, start, 4.0, accurate(1e-11, method)).value();
    const auto back =
        integrate(timed, 4.0, forth.final_state(), 1.0, accurate(1e-11, method)).value();
    EXPECT_LT((back.final_state() - start).norm(), 1e-9);
    EXPECT_LT((back.at(2.5) - forth.at(2.5)).norm(), 1e-5);
  }
}

// A ball from 10 m: at the ground at √(2·10/9.81) with -√(2·9.81·10), fast enough that a crossing
// and a return lie in one step of an exact method.
TEST(AdaptiveIntegration, TerminalEvent) {
  const auto ball = [](double, const Vector2d& x) { return Vector2d(x(1), -9.81); };
  const Event ground{[](double, const Vector2d& x) { return x(0); }, EventDirection::falling, true};
  const auto solution = integrate(ball, 0.0, Vector2d(10.0, 0.0), 100.0, {}, ground).value();
  ASSERT_EQ(solution.events().size(), 1u);
  EXPECT_TRUE(solution.ended_by_event());
  EXPECT_NEAR(solution.final_time(), std::sqrt(20.0 / 9.81), 1e-12);
  EXPECT_NEAR(solution.final_state()(0), 0.0, 1e-12);
  EXPECT_NEAR(solution.final_state()(1), -std::sqrt(2.0 * 9.81 * 10.0), 1e-11);
  EXPECT_EQ(solution.events()[0].t, solution.final_time());
  EXPECT_NEAR(solution.at(1.0)(0), 10.0 - 0.5 * 9.81, 1e-12);
  EXPECT_EQ(solution.at(50.0), solution.final_state());
}

// cos t crosses zero at π/2 + kπ, falling at the even ones; sin(t) - 1/2 rises at π/6 + 2kπ.
TEST(AdaptiveIntegration, SeveralEventsInOrderAndByDirection) {
  const auto position = [](double, const Vector2d& x) { return x(0); };
  const Event all{position};
  const Event falling{position, EventDirection::falling};
  const Event half{[](double, const Vector2d& x) { return -x(1) - 0.5; }, EventDirection::rising};
  const auto solution =
      integrate(oscillator, 0.0, Vector2d(1.0, 0.0), 4.0 * pi, accurate(1e-12), all, falling, half)
          .value();
  std::vector<double> times[3];
  double last = 0.0;
  for (const EventOccurrence& event : solution.events()) {
    times[event.event].push_back(event.t);
    EXPECT_GE(event.t, last);
    last = event.t;
  }
  ASSERT_EQ(times[0].size(), 4u);
  ASSERT_EQ(times[1].size(), 2u);
  ASSERT_EQ(times[2].size(), 2u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(times[0][k], pi / 2.0 + static_cast<double>(k) * pi, 2e-10);
  }
  EXPECT_NEAR(times[1][1], 2.5 * pi, 2e-10);
  EXPECT_NEAR(times[2][0], pi / 6.0, 2e-10);
  EXPECT_NEAR(times[2][1], pi / 6.0 + 2.0 * pi, 2e-10);
  EXPECT_FALSE(solution.ended_by_event());
}

// An event that is zero at the start has not happened: a ball leaves the ground and comes back.
TEST(AdaptiveIntegration, AnEventAtTheStartIsNotOne) {
  const auto ball = [](double, const Vector2d& x) { return Vector2d(x(1), -10.0); };
  const Event ground{[](double, const Vector2d& x) { return x(0); }, EventDirection::any, true};
  const auto solution = integrate(ball, 0.0, Vector2d(0.0, 5.0), 10.0, {}, ground).value();
  EXPECT_NEAR(solution.final_time(), 1.0, 1e-12);
}

TEST(AdaptiveIntegration, FixedAndDynamicSizesAgree) {
  const auto dynamic = [](double, const Eigen::VectorXd& x) {
    return Eigen::VectorXd{{x(1), -x(0)}};
  };
  const auto a = integrate(oscillator, 0.0, Vector2d(1.0, 0.0), 3.0).value();
  const auto b = integrate(dynamic, 0.0, Eigen::VectorXd{{1.0, 0.0}}, 3.0).value();
  EXPECT_EQ(a.final_state(), b.final_state());
  EXPECT_EQ(a.times(), b.times());
}

TEST(AdaptiveIntegration, NoTimeIsNoStep) {
  const auto solution = integrate(oscillator, 1.0, Vector2d(1.0, 2.0), 1.0).value();
  EXPECT_EQ(solution.times().size(), 1u);
  EXPECT_EQ(solution.at(1.0), Eigen::VectorXd(Vector2d(1.0, 2.0)));
}

TEST(AdaptiveIntegration, Refusals) {
  using Scalar = Eigen::Vector<double, 1>;
  const auto run = [](auto f, double t1, const IntegrationOptions& options = {}) {
    const auto solution = integrate([&](double t, const Scalar& x) { return Scalar(f(t, x(0))); },
                                    0.0, Scalar(1.0), t1, options);
    EXPECT_FALSE(solution.has_value());
    return solution ? Error(ArgumentError::empty) : solution.error();
  };
  const auto square = [](double, double x) { return x * x; };  // x = 1/(1 - t)
  for (const auto method : {IntegrationMethod::automatic, IntegrationMethod::radau}) {
    const Error singular = run(square, 2.0, {.method = method});
    EXPECT_TRUE(singular.is(IntegrationError::step_underflow) ||
                singular.is(IntegrationError::not_finite))
        << to_string(singular);
    EXPECT_NEAR(singular.evidence()[0].values[0], 1.0, 1e-6);
    EXPECT_TRUE(run([](double t, double) { return t > 0.5 ? NAN : 1.0; }, 1.0, {.method = method})
                    .is(IntegrationError::not_finite));
    EXPECT_TRUE(run([](double, double x) { return -x; }, 1e3, {.method = method, .max_steps = 5})
                    .is(IntegrationError::too_many_steps));
  }
  EXPECT_TRUE(run([](double, double) { return INFINITY; }, 1.0).is(IntegrationError::not_finite));
  EXPECT_TRUE(run(square, NAN).is(ArgumentError::not_finite));
  EXPECT_TRUE(run(square, 0.5, {.relative_tolerance = 0.0}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(run(square, 0.5, {.absolute_tolerance = 0.0}).is(ArgumentError::not_positive));
  EXPECT_TRUE(
      run(square, 0.5, {.absolute_tolerances = Vector2d(1.0, 1.0)}).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(run(square, 0.5, {.max_step = 0.0}).is(ArgumentError::not_positive));
  EXPECT_TRUE(run(square, 0.5, {.initial_step = -1.0}).is(ArgumentError::out_of_range));
  const Event broken{[](double t, const Vector2d&) { return t > 0.1 ? NAN : -1.0; }};
  EXPECT_TRUE(integrate(oscillator, 0.0, Vector2d(1.0, 0.0), 1.0, {}, broken)
                  .error()
                  .is(IntegrationError::not_finite));
  EXPECT_TRUE(
      integrate(oscillator, 0.0, Vector2d(1.0, NAN), 1.0).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      integrate([](double, const Eigen::VectorXd& x) { return x; }, 0.0, Eigen::VectorXd(), 1.0)
          .error()
          .is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball::adaptive_test
