#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/expression/differentiate.hpp>
#include <flyball/math/expression/formula.hpp>

#include "timing.hpp"

// A model by formula beside the same model compiled: the cart-pole's derivative, its Jacobian
// beside dual numbers, and what compiling the formulas costs. Budget: 3 times the compiled model a
// step.
namespace {

using namespace flyball;

struct CartPole {
  double m_c = 5.0;
  double m_p = 0.5;
  double l = 0.5;
  double g = 9.806;
  template <class T>
  Eigen::Vector<T, 4> operator()(const Eigen::Vector<T, 5>& x) const {
    using std::sin, std::cos;
    const T s = sin(x(1));
    const T c = cos(x(1));
    const T mass = m_c + m_p * s * s;
    return {x(2), x(3), (x(4) + m_p * s * (l * x(3) * x(3) + g * c)) / mass,
            (-(x(4) * c) - m_p * l * x(3) * x(3) * c * s - (m_c + m_p) * g * s) / (l * mass)};
  }
};

const expression::FormulaSet formulas{
    .variables = {{"x", "m"}, {"θ", "rad"}, {"v", "m/s"}, {"ω", "rad/s"}, {"F", "N"}},
    .parameters = {{"m_c", "kg", 5.0}, {"m_p", "kg", 0.5}, {"l", "m", 0.5}, {"g", "m/s^2", 9.806}},
    .definitions = {{"s", "sin(θ)"}, {"c", "cos(θ)"}, {"mass", "m_c + m_p*s^2", "kg"}},
    .outputs = {{"x", "v", "m/s"},
                {"θ", "ω", "rad/s"},
                {"v", "(F + m_p*s*(l*ω^2 + g*c))/mass", "m/s^2"},
                {"ω", "(-F*c - m_p*l*ω^2*c*s - (m_c + m_p)*g*s)/(l*mass)", "rad/s^2"}}};

/// The smallest of several, another process may hold the machine in any of them; in ns.
template <class Work>
double best(int calls, Work&& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 25; ++k) {
    least = std::min(least, 1000.0 * bench::microseconds(calls, work));
  }
  return least;
}

}  // namespace

int main() {
  const auto compiled = expression::compile(formulas).value();
  const expression::Derivatives derivatives = expression::differentiate(compiled.tape);
  std::vector<double> values(compiled.tape.size());
  compiled.tape.prepare<double>(compiled.parameters, values);
  std::vector<double> values_j(derivatives.workspace_size());
  derivatives.tape.prepare<double>(compiled.parameters, values_j);

  // Each step's input hangs on the step before, as in a simulation.
  CartPole model;
  Eigen::Vector<double, 5> x{0.1, 0.2, 0.3, 0.4, 0.5};
  Eigen::Vector4d y = Eigen::Vector4d::Zero();
  double sum = 0.0;
  const auto next = [&] {
    x(1) = 0.2 + 1e-3 * y(3);
    sum += y(2);
  };
  const double by_code = best(20'000, [&] {
    y = model(x);
    next();
  });
  const double by_formula = best(20'000, [&] {
    compiled.tape.evaluate<double>({x.data(), 5}, {y.data(), 4}, values);
    next();
  });
  Eigen::MatrixXd J(4, 5);
  const double by_dual = best(5'000, [&] {
    const auto jacobian = flyball::jacobian([&](const auto& at) { return model(at.eval()); }, x);
    J = jacobian;
    y(3) = J(3, 1);
    next();
  });
  const double by_tape = best(5'000, [&] {
    derivatives.evaluate({x.data(), 5}, {y.data(), 4}, J, values_j);
    y(3) = J(3, 1);
    next();
  });
  const double compiling =
      best(100, [&] { sum += static_cast<double>(expression::compile(formulas)->tape.size()); });

  std::printf("cart-pole                compiled    by formula   ratio\n");
  std::printf("derivative             %7.1f ns    %7.1f ns   %5.2f   (%zu nodes)\n", by_code,
              by_formula, by_formula / by_code, compiled.tape.size());
  std::printf("derivative, Jacobian   %7.1f ns    %7.1f ns   %5.2f   (%zu nodes)\n", by_dual,
              by_tape, by_tape / by_dual, derivatives.tape.size());
  std::printf("reading the formulas               %7.1f us\n", compiling / 1000.0);
  return std::isfinite(sum) ? 0 : 1;
}
