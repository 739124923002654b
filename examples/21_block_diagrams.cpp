// Appendix A's rules on real systems: two blocks in series, in parallel and in a loop, as state
// space, and at one point s beside the products and sums of their transfer functions.
#include <cmath>
#include <complex>
#include <cstdio>

#include <flyball/systems/interconnection.hpp>

int main() {
  using namespace flyball;
  using Complex = std::complex<double>;
  const auto one = [](double x) { return Eigen::MatrixXd::Constant(1, 1, x).eval(); };

  //! [blocks]
  const ContinuousSystem<> G{one(-1.0), one(2.0), one(1.0), one(0.0)};  // 2/(s + 1)
  const ContinuousSystem<> H{one(-5.0), one(3.0), one(1.0), one(0.0)};  // 3/(s + 5)
  const auto cascade = series(G, H).value();                            // A.1: HG
  const auto sum = parallel(G, H).value();                              // A.2: G + H
  const auto loop = feedback(G, H).value();                             // A.4: G/(1 + GH)
  //! [blocks]

  const Complex s(0.3, 2.0);
  const Complex g = 2.0 / (s + 1.0);
  const Complex h = 3.0 / (s + 5.0);
  double worst = 0.0;
  const auto row = [&](const char* name, const ContinuousSystem<>& system, Complex rule) {
    const Complex found = transfer_at(system, s).value()(0);
    std::printf("%-12s %.6f%+.6fi by states, %.6f%+.6fi by the rule\n", name, found.real(),
                found.imag(), rule.real(), rule.imag());
    worst = std::fmax(worst, std::abs(found - rule));
  };
  row("HG", cascade, h * g);
  row("G + H", sum, g + h);
  row("G/(1 + GH)", loop, g / (1.0 + g * h));
  return worst < 1e-14 ? 0 : 1;
}
