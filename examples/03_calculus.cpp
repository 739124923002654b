// The rules of chapter 4 without symbols: derivatives by dual numbers, exact but for rounding, and
// an integral by quadrature, each beside what the tables say.
#include <cmath>
#include <cstdio>

#include <Eigen/Core>

#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/integration/quadrature.hpp>

namespace {

bool all_agree = true;

void row(const char* what, double computed, double table) {
  std::printf("%-36s %18.12f %18.12f\n", what, computed, table);
  all_agree = all_agree && std::abs(computed - table) <= 1e-12 * std::abs(table);
}

}  // namespace

int main() {
  using namespace flyball;
  const double x = 0.7;
  const double a = 2.5;
  std::printf("%-36s %18s %18s\n", "", "computed", "by the rule");
  //! [slope]
  const auto slope = [](auto f, double at) {
    return gradient([&](const auto& v) { return f(v(0)); }, Eigen::Vector<double, 1>(at))(0);
  };
  row("power: (x^5)'", slope([](const auto& v) { return pow(v, 5.0); }, x), 5.0 * std::pow(x, 4));
  row("product: (x sin x)'", slope([](const auto& v) { return v * sin(v); }, x),
      std::sin(x) + x * std::cos(x));
  row("chain: ((3x + 2)^5)'", slope([](const auto& v) { return pow(3.0 * v + 2.0, 5.0); }, x),
      15.0 * std::pow(3.0 * x + 2.0, 4));
  //! [slope]
  //! [partial]
  const auto partial = gradient([](const auto& v) { return 3.0 * v(0) * v(1) + 2.0 * v(0); },
                                Eigen::Vector2d(x, 4.0));
  row("partial: d/dx (3xy + 2x), y = 4", partial(0), 3.0 * 4.0 + 2.0);
  row("partial: d/dy (3xy + 2x)", partial(1), 3.0 * x);
  //! [partial]
  //! [integral]
  const auto integral = quadrature([&](double t) { return std::exp(a * t); }, 0.0, x).value();
  row("integral of e^(at) from 0 to x", integral.value, (std::exp(a * x) - 1.0) / a);
  //! [integral]
  std::printf("the integral took %d values, and thinks itself right to %.0e\n",
              integral.evaluations, integral.error);
  return all_agree ? 0 : 1;
}
