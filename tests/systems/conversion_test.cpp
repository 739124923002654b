#include <flyball/systems/conversion.hpp>

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/systems/discretize.hpp>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::conversion_test {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;
using test::matrix_from;

constexpr ConversionMethod all_methods[] = {
    ConversionMethod::zoh, ConversionMethod::foh, ConversionMethod::tustin,
    ConversionMethod::forward_euler, ConversionMethod::backward_euler};

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

ContinuousSystem<> first_order(double a, double b, double c, double d) {
  return {scalar(a), scalar(b), scalar(c), scalar(d)};
}

double distance(const ContinuousSystem<>& a, const ContinuousSystem<>& b) {
  return std::max({(a.A - b.A).norm() / (1.0 + b.A.norm()), (a.B - b.B).norm() / (1.0 + b.B.norm()),
                   (a.C - b.C).norm() / (1.0 + b.C.norm()),
                   (a.D - b.D).norm() / (1.0 + b.D.norm())});
}

// dx/dt = -2x + u, y = x, T = 0.5: aT = 1, in closed form.
TEST(Conversion, ScalarInClosedForm) {
  const auto plant = first_order(-2.0, 1.0, 1.0, 0.0);
  const Time T(0.5);
  const double e = std::exp(-1.0);
  const auto zoh = discretize(plant, T, ConversionMethod::zoh).value();
  EXPECT_NEAR(zoh.A(0, 0), e, 1e-16);
  EXPECT_NEAR(zoh.B(0, 0), (1.0 - e) / 2.0, 1e-16);
  // φ₁ = 1 - e, φ₂ = e of x = -1: D = T φ₂, B = T φ₁².
  const auto foh = discretize(plant, T, ConversionMethod::foh).value();
  EXPECT_NEAR(foh.B(0, 0), 0.5 * (1.0 - e) * (1.0 - e), 1e-16);
  EXPECT_NEAR(foh.D(0, 0), 0.5 * e, 1e-16);
  // (1 + aT/2)/(1 - aT/2) = 0.5/1.5.
  const auto tustin = discretize(plant, T, ConversionMethod::tustin).value();
  EXPECT_NEAR(tustin.A(0, 0), 1.0 / 3.0, 1e-16);
  EXPECT_NEAR(tustin.B(0, 0), 1.0 / 3.0, 1e-16);
  EXPECT_NEAR(tustin.C(0, 0), 2.0 / 3.0, 1e-16);
  EXPECT_NEAR(tustin.D(0, 0), 1.0 / 6.0, 1e-16);
  EXPECT_NEAR(discretize(plant, T, ConversionMethod::forward_euler).value().A(0, 0), 0.0, 1e-16);
  EXPECT_NEAR(discretize(plant, T, ConversionMethod::backward_euler).value().A(0, 0), 0.5, 1e-16);
  const auto matched = discretize(plant, T, ConversionMethod::matched).value();
  EXPECT_NEAR(matched.A(0, 0), e, 1e-16);
  EXPECT_NEAR(matched.C(0, 0) * matched.B(0, 0) / (1.0 - e), 0.5, 1e-16);
  EXPECT_EQ(matched.D(0, 0), 0.0);
}

TEST(Conversion, Gold) {
  for (const auto& c : test::cases_of("conversion.json")) {
    const ContinuousSystem<> plant{matrix_from(c["A"]), matrix_from(c["B"]), matrix_from(c["C"]),
                                   matrix_from(c["D"])};
    const Time T(c["T"].get<double>());
    for (const auto& [key, method, prewarp] :
         {std::tuple{"zoh", ConversionMethod::zoh, false},
          {"foh", ConversionMethod::foh, false},
          {"tustin", ConversionMethod::tustin, false},
          {"tustin_prewarped", ConversionMethod::tustin, true},
          {"forward-euler", ConversionMethod::forward_euler, false},
          {"backward-euler", ConversionMethod::backward_euler, false}}) {
      const auto found =
          discretize(plant, T, method, AngularVelocity(prewarp ? c["prewarp"].get<double>() : 0.0))
              .value();
      const auto& gold = c[key];
      for (const auto& [name, M] : {std::pair<const char*, const MatrixXd&>{"A", found.A},
                                    {"B", found.B},
                                    {"C", found.C},
                                    {"D", found.D}}) {
        const MatrixXd expected = matrix_from(gold[name]);
        EXPECT_LE((M - expected).norm(), 1e-14 * expected.norm())
            << c["name"] << ' ' << key << ' ' << name;
      }
      for (const auto& point : gold["H"]) {
        const MatrixXd re = matrix_from(point["re"]);
        const MatrixXd im = matrix_from(point["im"]);
        const auto H = test::response(found, std::polar(1.0, point["theta"].get<double>()));
        EXPECT_LE((H.real() - re).norm() + (H.imag() - im).norm(), 1e-12 * (re.norm() + im.norm()))
            << c["name"] << ' ' << key;
      }
    }
    const auto Q = discretize(plant.A, ProcessDensity{matrix_from(c["density"])}, T).value();
    const MatrixXd expected = matrix_from(c["covariance"]);
    EXPECT_LE((Q - expected).norm(), 1e-13 * expected.norm()) << c["name"];
    EXPECT_LE((Q - expected).cwiseAbs().cwiseQuotient(expected.cwiseAbs()).maxCoeff(), 1e-12)
        << c["name"];
  }
}

TEST(Conversion, MatchedGold) {
  int seen = 0;
  for (const auto& c : test::cases_of("conversion.json")) {
    if (!c.contains("matched")) {
      continue;
    }
    ++seen;
    const ContinuousSystem<> plant{matrix_from(c["A"]), matrix_from(c["B"]), matrix_from(c["C"]),
                                   matrix_from(c["D"])};
    const auto found =
        discretize(plant, Time(c["T"].get<double>()), ConversionMethod::matched).value();
    const auto num = c["matched"]["num"].get<std::vector<double>>();
    const auto den = c["matched"]["den"].get<std::vector<double>>();
    const auto horner = [](const std::vector<double>& p, Complex z) {
      Complex value = 0.0;
      for (const double x : p) {
        value = value * z + x;
      }
      return value;
    };
    for (const double theta : {0.3, 1.0, 2.0, 2.9}) {
      const Complex z = std::polar(1.0, theta);
      const Complex expected = horner(num, z) / horner(den, z);
      EXPECT_LE(std::abs(test::response(found, z)(0, 0) - expected), 1e-12 * std::abs(expected))
          << c["name"] << ' ' << theta;
    }
    const auto returned = undiscretize(found, ConversionMethod::matched);
    if (!returned) {
      // e^{-10000} is zero, and e^{-200} below the rounding of the others.
      EXPECT_TRUE(c["name"] == "stiff" || c["name"] == "stiff_hi") << c["name"];
      EXPECT_TRUE(returned.error().is(SystemError::no_image));
      continue;
    }
    const ContinuousSystem<>& back = *returned;
    for (const double w : {0.1, 1.0, 10.0}) {
      const Complex expected = test::response(plant, {0.0, w})(0, 0);
      EXPECT_LE(std::abs(test::response(back, {0.0, w})(0, 0) - expected),
                1e-10 * std::abs(expected))
          << c["name"] << ' ' << w;
    }
  }
  EXPECT_EQ(seen, 6);
}

// G_d(z) = G(s(z)) is what the substitutions mean; prewarping makes them meet at ω.
TEST(Conversion, SubstitutionsHold) {
  Random random(71);
  int tested = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const auto plant = test::random_system(random, 1 + trial % 6, 1 + trial % 2, 1 + trial % 3);
    const double T = std::pow(10.0, random.uniform(-3.0, 0.3));
    const double omega = random.uniform(0.1, 3.0) / T;
    const Complex z = std::polar(random.uniform(0.5, 1.5), random.uniform(0.1, 3.1));
    const auto agrees = [&](const auto& discrete, Complex at, Complex s) {
      const Eigen::MatrixXcd expected = test::response(plant, s);
      const Eigen::MatrixXcd found = test::response(discrete, at);
      // Rounding of A_d is one of T(s - λ).
      return (found - expected).norm() <=
             1e-9 * (1.0 + expected.norm()) * (1.0 + expected.norm()) / std::min(1.0, T);
    };
    const auto tustin = discretize(plant, Time(T), ConversionMethod::tustin);
    if (tustin) {
      ++tested;
      EXPECT_TRUE(agrees(*tustin, z, 2.0 / T * (z - 1.0) / (z + 1.0)));
      const auto prewarped =
          discretize(plant, Time(T), ConversionMethod::tustin, AngularVelocity(omega)).value();
      EXPECT_TRUE(agrees(prewarped, std::polar(1.0, omega * T), {0.0, omega}));
    }
    EXPECT_TRUE(agrees(discretize(plant, Time(T), ConversionMethod::forward_euler).value(), z,
                       (z - 1.0) / T));
    const auto backward = discretize(plant, Time(T), ConversionMethod::backward_euler);
    if (backward) {
      EXPECT_TRUE(agrees(*backward, z, (z - 1.0) / (T * z)));
    }
  }
  EXPECT_GT(tested, 990);
}

// First-order hold is exact for a ramp: y(kT) of the sampled system is y(kT) of the plant, which is
// zero-order hold of the plant with an integrator before it.
TEST(Conversion, FirstOrderHoldIsExactForRamps) {
  Random random(72);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const auto plant = test::random_stable_system(random, n, 1, 1);
    const Time T(random.uniform(0.01, 1.0));
    const auto foh = discretize(plant, T, ConversionMethod::foh).value();
    MatrixXd A = MatrixXd::Zero(n + 1, n + 1);
    A.topLeftCorner(n, n) = plant.A;
    A.topRightCorner(n, 1) = plant.B;
    MatrixXd B = MatrixXd::Zero(n + 1, 1);
    B(n, 0) = 1.0;
    const auto ramp = discretize_zoh(A, B, T).value();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(n + 1);
    // The states of the hold are x - T φ₂ B u; u(0) = 0.
    Eigen::VectorXd held = Eigen::VectorXd::Zero(n);
    for (int k = 0; k < 20; ++k) {
      const double u = k * T.si();
      const double y = (plant.C * x.head(n))(0) + plant.D(0, 0) * u;
      const double y_held = (foh.C * held)(0) + foh.D(0, 0) * u;
      ASSERT_NEAR(y_held, y, 1e-11 * (1.0 + std::abs(y)));
      x = (ramp.A * x + ramp.B).eval();
      held = (foh.A * held + foh.B * u).eval();
    }
  }
}

TEST(Conversion, ComesBack) {
  Random random(73);
  int refused = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const auto plant = test::random_system(random, 1 + trial % 6, 1 + trial % 3, 1 + trial % 2);
    // Below the Nyquist frequency of every pole.
    const double T = random.uniform(0.05, 2.0) / plant.A.norm();
    for (const ConversionMethod method : all_methods) {
      const AngularVelocity prewarp(method == ConversionMethod::tustin && trial % 2 == 0 ? 1.0 / T
                                                                                         : 0.0);
      const auto there = discretize(plant, Time(T), method, prewarp);
      const auto back =
          there ? undiscretize(*there, method, prewarp) : Expected<ContinuousSystem<>>(plant);
      if (!back) {
        // Forward Euler may put a pole where no other has an image; nothing else may.
        ++refused;
        continue;
      }
      const double condition =
          method == ConversionMethod::backward_euler || method == ConversionMethod::tustin
              ? 1.0 / test::singular_values(there->A).minCoeff() + 10.0
              : 10.0;
      EXPECT_LT(distance(*back, plant), 1e-12 * std::max(condition, 10.0 / T))
          << to_string(method) << ' ' << trial;
    }
  }
  EXPECT_EQ(refused, 0);
}

TEST(Conversion, MatchedComesBack) {
  Random random(74);
  int tested = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    auto plant = test::random_stable_system(random, 1 + trial % 4, 1, 1);
    if (trial % 2 == 0) {
      plant.D.setZero();
    }
    const double T = random.uniform(0.1, 1.5) / plant.A.norm();
    const auto discrete = discretize(plant, Time(T), ConversionMethod::matched).value();
    // Poles and gain at s = 0 are the rule.
    EXPECT_LT(std::abs(test::response(discrete, 1.0)(0, 0) - test::response(plant, 0.0)(0, 0)),
              1e-9 * (1.0 + std::abs(test::response(plant, 0.0)(0, 0))) / T);
    // A zero beyond the Nyquist frequency is folded, and does not come back.
    const Eigen::Index n = plant.A.rows();
    MatrixXd pencil(n + 1, n + 1);
    pencil << plant.A, plant.B, plant.C, plant.D;
    MatrixXd states = MatrixXd::Identity(n + 1, n + 1);
    states(n, n) = 0.0;
    const auto [alphas, betas] = test::generalized_eigenvalues(pencil, states);
    bool fast = false;
    for (Eigen::Index k = 0; k <= n; ++k) {
      const double size = std::abs(alphas(k)) / std::abs(betas(k));
      fast = fast || (size * T > 2.5 && size < 1e8);
    }
    if (fast) {
      continue;
    }
    ++tested;
    const auto back = undiscretize(discrete, ConversionMethod::matched);
    ASSERT_TRUE(back.has_value()) << to_string(back.error());
    const Complex s(0.3, 0.7);
    const Complex expected = test::response(plant, s)(0, 0);
    EXPECT_LT(std::abs(test::response(*back, s)(0, 0) - expected),
              1e-7 * (1.0 + std::abs(expected)))
        << trial;
  }
  EXPECT_GT(tested, 600);
}

TEST(Conversion, KeepsFixedSizes) {
  ContinuousSystem<2, 1, 1> plant;
  plant.A << 0.0, 1.0, -4.0, -0.4;
  plant.B << 0.0, 1.0;
  plant.C << 1.0, 0.0;
  plant.D << 0.0;
  const DiscreteSystem<2, 1, 1> fixed = discretize(plant, Time(0.1), ConversionMethod::foh).value();
  const auto dynamic = discretize(ContinuousSystem<>{plant.A, plant.B, plant.C, plant.D}, Time(0.1),
                                  ConversionMethod::foh)
                           .value();
  EXPECT_EQ(fixed.A, dynamic.A);
  EXPECT_EQ(fixed.B, dynamic.B);
  const ContinuousSystem<2, 1, 1> back = undiscretize(fixed, ConversionMethod::foh).value();
  EXPECT_LT((back.A - plant.A).norm() + (back.B - plant.B).norm(), 1e-13);
}

// States in units 1e±8 apart: a change of units commutes with each method, to the last digits.
TEST(Conversion, UnitsDoNotMatter) {
  Random random(75);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const auto plant = test::random_stable_system(random, n, 1, 1);
    const Eigen::VectorXd d = test::random_scales(random, n, 8.0);
    const auto scaled = test::rescaled(plant, d);
    const Time T(0.2);
    for (const ConversionMethod method : all_methods) {
      const auto plain = discretize(plant, T, method).value();
      const auto found = discretize(scaled, T, method);
      ASSERT_TRUE(found.has_value()) << to_string(found.error());
      EXPECT_LT((d.asDiagonal() * found->A * d.cwiseInverse().asDiagonal() - plain.A).norm(),
                1e-11 * (1.0 + plain.A.norm()))
          << to_string(method);
      EXPECT_LT((d.asDiagonal() * found->B - plain.B).norm(), 1e-11 * (1.0 + plain.B.norm()));
    }
  }
}

TEST(Conversion, Errors) {
  const Time T(0.5);
  const auto tustin = discretize(first_order(4.0, 1.0, 1.0, 0.0), T, ConversionMethod::tustin);
  ASSERT_FALSE(tustin.has_value());
  EXPECT_TRUE(tustin.error().is(SystemError::no_image));
  EXPECT_EQ(to_string(tustin.error()),
            "discretize: A is with an eigenvalue that tustin maps to infinity; it must be without "
            "the eigenvalue 4; choose another period or zoh (eigenvalue = [4, 0])");
  EXPECT_TRUE(discretize(first_order(2.0, 1.0, 1.0, 0.0), T, ConversionMethod::backward_euler)
                  .error()
                  .is(SystemError::no_image));
  const auto back = [&](double a, ConversionMethod method) {
    return undiscretize(DiscreteSystem<>{scalar(a), scalar(1.0), scalar(1.0), scalar(0.0), T},
                        method)
        .error();
  };
  EXPECT_TRUE(back(-0.5, ConversionMethod::zoh).is(MatrixFunctionError::no_real_logarithm));
  EXPECT_TRUE(back(0.0, ConversionMethod::foh).is(MatrixFunctionError::no_real_logarithm));
  EXPECT_TRUE(back(-1.0, ConversionMethod::tustin).is(SystemError::no_image));
  EXPECT_TRUE(back(0.0, ConversionMethod::backward_euler).is(SystemError::no_image));
  EXPECT_TRUE(back(-0.5, ConversionMethod::matched).is(SystemError::no_image));
  EXPECT_TRUE(discretize(first_order(-1.0, 0.0, 1.0, 0.0), T, ConversionMethod::matched)
                  .error()
                  .is(SystemError::zero_transfer));
  Random random(1);
  EXPECT_TRUE(discretize(test::random_system(random, 2, 2, 1), T, ConversionMethod::matched)
                  .error()
                  .is(ArgumentError::wrong_shape));
  const auto plant = first_order(-1.0, 1.0, 1.0, 0.0);
  for (const ConversionMethod method : all_methods) {
    EXPECT_TRUE(discretize(plant, Time(0.0), method).error().is(ArgumentError::not_positive));
    EXPECT_TRUE(discretize(plant, Time(NAN), method).error().is(ArgumentError::not_finite));
    EXPECT_TRUE(discretize(first_order(NAN, 1.0, 1.0, 0.0), T, method)
                    .error()
                    .is(ArgumentError::not_finite));
    EXPECT_TRUE(discretize(ContinuousSystem<>{}, T, method).error().is(ArgumentError::empty));
  }
  EXPECT_TRUE(discretize(plant, T, ConversionMethod::tustin, AngularVelocity(7.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(discretize(plant, T, ConversionMethod::zoh, AngularVelocity(1.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_EQ(parse_conversion_method("backward-euler").value(), ConversionMethod::backward_euler);
  EXPECT_TRUE(parse_conversion_method("tustn").error().is(ArgumentError::unknown_name));
  for (const ConversionMethod method : all_methods) {
    EXPECT_EQ(parse_conversion_method(to_string(method)).value(), method);
  }
}

}  // namespace
}  // namespace flyball::conversion_test
