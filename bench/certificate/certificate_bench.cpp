#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <vector>

#include <flyball/control/certificate.hpp>

#include "random_loops.hpp"

// Proofs of stability for every plant of a set: how many of random loops are decided and in what
// processor time, and whether a search of many members finds an unstable one where stability was
// proven.
namespace {

using namespace flyball;

/// Members at random, half of them at corners, where loops break first.
Eigen::VectorXd random_member(const ParameterSet& set, bench::Random& random) {
  Eigen::VectorXd z(set.axes.cols());
  const bool edge = random() % 2 == 0;
  for (double& x : z) {
    x = bench::uniform(random, -1.0, 1.0);
    x = edge && random() % 4 != 0 ? std::copysign(1.0, x) : x;
  }
  return set.centre + set.axes * z;
}

bool search_finds_unstable(const UncertainLoop& loop, int members, bench::Random& random) {
  for (int k = 0; k < members; ++k) {
    const auto member = loop_of(loop, random_member(loop.set, random));
    const auto radius = closed_loop_radius(*member);
    if (radius && *radius >= 1.0) {
      return true;
    }
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  const int loops = argc > 1 ? std::atoi(argv[1]) : 1000;
  const int members = argc > 2 ? std::atoi(argv[2]) : 1000;
  const CertificateOptions options{.margins = argc > 3};
  bench::Random random(1);
  int stable = 0, unstable = 0, undecided = 0, wrong = 0;
  std::vector<double> times;
  std::vector<int> pieces;
  for (int k = 0; k < loops; ++k) {
    const UncertainLoop loop = bench::random_loop(random);
    Expected<LoopCertificate> answer = LoopCertificate{};
    const std::clock_t start = std::clock();
    answer = certify_loop(loop, options);
    times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    pieces.push_back(answer->pieces);
    switch (answer->verdict) {
      case LoopVerdict::stable:
        ++stable;
        wrong += search_finds_unstable(loop, members, random) ? 1 : 0;
        break;
      case LoopVerdict::unstable:
        ++unstable;
        break;
      case LoopVerdict::undecided:
        ++undecided;
        std::printf("undecided: loop %d, share %.2g, radius found %.9f, %d pieces, %.0f ms\n", k,
                    answer->undecided_share, answer->slowest.spectral_radius, answer->pieces,
                    times.back());
        break;
    }
  }
  std::sort(times.begin(), times.end());
  std::sort(pieces.begin(), pieces.end());
  const auto at = [&](double share) {
    return static_cast<std::size_t>(share * static_cast<double>(times.size() - 1));
  };
  std::printf("%d loops: %d proven stable, %d with an unstable member, %d undecided (%.2g %%)\n",
              loops, stable, unstable, undecided, 100.0 * undecided / loops);
  std::printf("proven, but a search of %d members found an unstable one: %d\n", members, wrong);
  std::printf(
      "processor time: median %.2f ms, 95 %% %.1f ms, largest %.0f ms; pieces: median %d, 95 %% "
      "%d\n",
      times[at(0.5)], times[at(0.95)], times.back(), pieces[at(0.5)], pieces[at(0.95)]);
  return wrong == 0 ? 0 : 1;
}
