// Identifies a simulated log and prints the gains beside the true ones.
#include <cmath>
#include <cstdio>

#include <flyball/study/identify.hpp>
#include <flyball/study/project.hpp>

namespace {

void print_row(const char* name, const char* unit, double truth,
               const flyball::identification::GainEstimate& gain) {
  const bool covered = gain.interval[0] <= truth && truth <= gain.interval[1];
  std::printf("  %-3s %10.5g %12.5g   [%.5g, %.5g] %s   %+.2f %%%s\n", name, truth, gain.value,
              gain.interval[0], gain.interval[1], unit, 100.0 * (gain.value / truth - 1.0),
              covered ? "" : "   (truth outside)");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace flyball;
  if (argc != 3) {
    std::fprintf(stderr, "usage: true_versus_identified LOG TRUTH.toml\n");
    return 2;
  }
  const auto truth = study::read_project(argv[2]);
  if (!truth) {
    std::fprintf(stderr, "%s\n", to_string(truth.error()).c_str());
    return 2;
  }
  const auto result = study::identify({.log = argv[1], .selection = {}});
  if (!result || !result->report.fit) {
    const Error& error = result ? result->report.fit.error() : result.error();
    std::fprintf(stderr, "%s\n", to_string(error).c_str());
    return 1;
  }
  const mechanisms::FeedforwardGains& gains = truth->job.plant.gains;
  const identification::FeedforwardFit& fit = *result->report.fit;
  std::printf("\n  gain    true   identified   95 %% interval            error\n");
  print_row("kS", "V", gains.kS, fit.kS);
  print_row("kV", "V·s/m", gains.kV, fit.kV);
  print_row("kA", "V·s²/m", gains.kA, fit.kA);
  if (fit.kG) {
    print_row("kG", "V", gains.kG, *fit.kG);
  }
}
