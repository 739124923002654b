// One complex transform, planned before, beside FFTW's (FFTW_ESTIMATE) on the same numbers in the
// same process: minima over interleaved repetitions, and the difference of both relative to FFTW's.

#include <algorithm>
#include <complex>
#include <cstdio>

#include <Eigen/Core>
#include <fftw3.h>

#include <flyball/core/random.hpp>
#include <flyball/math/spectra/fft.hpp>

#include "timing.hpp"

int main() {
  using bench::microseconds;
  std::printf("| n | Fft, us | FFTW, us | ratio | difference |\n|---:|---:|---:|---:|---:|\n");
  flyball::Random random(1);
  for (const int n : {64, 100, 256, 360, 1000, 1021, 1024, 4096, 10007, 65536, 100000, 1048576}) {
    Eigen::VectorXcd x(n);
    for (auto& value : x) {
      value = {random.normal(), random.normal()};
    }
    Eigen::VectorXcd ours(n);
    Eigen::VectorXcd theirs(n);
    auto plan = flyball::Fft::create(n).value();
    auto* in = reinterpret_cast<fftw_complex*>(x.data());
    auto* out = reinterpret_cast<fftw_complex*>(theirs.data());
    const fftw_plan peer = fftw_plan_dft_1d(n, in, out, FFTW_FORWARD, FFTW_ESTIMATE);
    const int calls = std::max(1, 200'000 / n);
    double best[2] = {1e18, 1e18};
    for (int k = 0; k < 20; ++k) {
      best[0] =
          std::min(best[0], microseconds(calls, [&] { plan.forward(x.data(), ours.data()); }));
      best[1] = std::min(best[1], microseconds(calls, [&] { fftw_execute(peer); }));
    }
    std::printf("| %d | %.2f | %.2f | %.2f | %.1e |\n", n, best[0], best[1], best[1] / best[0],
                (ours - theirs).norm() / theirs.norm());
    fftw_destroy_plan(peer);
  }
}
