// Nyquist curves and root loci of thirty poles: thirty_poles [how many loops].
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/nyquist.hpp>
#include <flyball/classical/root_locus.hpp>
#include <flyball/core/random.hpp>

namespace {

using namespace flyball;
using namespace flyball::classical;

/// Of a decade and a half, half of the poles in weakly damped pairs, ten zeros.
TransferFunction loop_of(Random& random) {
  std::vector<std::complex<double>> poles;
  std::vector<std::complex<double>> zeros;
  const auto place = [&](std::vector<std::complex<double>>& roots, std::size_t count) {
    while (roots.size() < count) {
      const double w = std::pow(10.0, 1.5 * random.uniform() - 0.75);
      if (roots.size() % 4 < 2 && roots.size() + 2 <= count) {
        const double damping = 0.02 + 0.5 * random.uniform();
        const std::complex<double> s(-damping * w, w * std::sqrt(1.0 - damping * damping));
        roots.push_back(s);
        roots.push_back(std::conj(s));
      } else {
        roots.emplace_back(-w, 0.0);
      }
    }
  };
  place(poles, 30);
  place(zeros, 10);
  const auto vector = [](const std::vector<std::complex<double>>& roots) {
    return Eigen::VectorXcd(
        Eigen::Map<const Eigen::VectorXcd>(roots.data(), static_cast<Eigen::Index>(roots.size())));
  };
  return TransferFunction::from_zeros(vector(zeros), vector(poles), 1.0).value();
}

struct Times {
  std::vector<double> ms{};

  void print(const char* name) {
    std::sort(ms.begin(), ms.end());
    std::printf("%-12s median %7.2f ms  largest %7.2f ms\n", name, ms[ms.size() / 2], ms.back());
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 20;
  Random random(30);
  Times curves;
  Times loci;
  for (int i = 0; i < count; ++i) {
    const TransferFunction L = loop_of(random);
    const auto least = [&](auto&& work) {
      // The processor's time: another process may hold the machine for longer than a locus takes.
      double best = 1e300;
      for (int k = 0; k < 3; ++k) {
        const std::clock_t start = std::clock();
        work();
        best = std::min(best, 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      }
      return best;
    };
    curves.ms.push_back(least([&] {
      if (!nyquist(frequency_response(L).value())) {
        std::printf("loop %d has no curve\n", i);
      }
    }));
    loci.ms.push_back(least([&] {
      if (!root_locus(L)) {
        std::printf("loop %d has no locus\n", i);
      }
    }));
  }
  std::printf("%d loops of thirty poles and ten zeros, the least of three\n", count);
  curves.print("nyquist");
  loci.print("root locus");
}
