// Public benchmarks of nonlinear identification, free simulation on the part that is kept aside.
// The numbers are those of docs/benchmarks.md.
#include <cstdio>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include <flyball/io/csv.hpp>
#include <flyball/study/identify_model.hpp>

namespace flyball::study::benchmark_models_test {
namespace {

const std::string folder = FLYBALL_TEST_DATA "/benchmarks/";
const std::string examples = FLYBALL_EXAMPLES "/";

/// A file that may be compressed, by the tool that everybody has.
std::string contents(const std::string& path) {
  std::string text;
  std::FILE* const pipe = ::popen(("gzip -cdf '" + path + "'").c_str(), "r");
  if (pipe == nullptr) {
    return text;
  }
  char buffer[1 << 16];
  for (std::size_t read = 0; (read = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
    text.append(buffer, read);
  }
  ::pclose(pipe);
  return text;
}

/// @param starts  Values of [model.parameters] in place of the file's.
double validation_error(const std::string& data, const std::string& model,
                        const std::map<std::string, std::string>& starts = {}) {
  std::string text = contents(examples + model);
  for (const auto& [name, value] : starts) {
    const std::size_t at = text.find("\n" + name + " = \"");
    if (at == std::string::npos) {
      ADD_FAILURE() << name;
      return 1e300;
    }
    text.replace(at, text.find('\n', at + 1) - at, "\n" + name + " = \"" + value + "\"");
  }
  const auto project = parse_project(text, model);
  if (!project) {
    ADD_FAILURE() << to_string(project.error());
    return 1e300;
  }
  const auto log = parse_csv(contents(folder + data), data, *project->fit.period);
  if (!log) {
    ADD_FAILURE() << to_string(log.error());
    return 1e300;
  }
  const auto result = identify_model(*log, *project);
  if (!result) {
    ADD_FAILURE() << to_string(result.error());
    return 1e300;
  }
  EXPECT_TRUE(result->fit.minimum.converged) << to_string(result->fit.minimum.stop);
  EXPECT_EQ(result->validation.size(), 1U);
  return result->validation.front().outputs.front().rmse;
}

// Published 0.34 to 0.76 V (Math. Probl. Eng. 2021, 6613425, Table 2).
TEST(BenchmarkModels, CascadedTanksByTheirSquareRoots) {
  EXPECT_LT(validation_error("cascaded_tanks_dataBenchmark.csv", "cascaded_tanks.toml"), 0.34);
}
TEST(BenchmarkModels, CascadedTanksWithMoreOfTheirOutlets) {
  EXPECT_LT(validation_error("cascaded_tanks_dataBenchmark.csv", "cascaded_tanks_extended.toml"),
            0.26);
}
TEST(BenchmarkModels, SilverboxByDuffingsOscillator) {
  EXPECT_LT(validation_error("silverbox_SNLS80mV.csv.gz", "silverbox.toml"), 0.5e-3);
}
// What the best model without the diode leaves is the diode's.
TEST(BenchmarkModels, WienerHammersteinWithoutItsNonlinearity) {
  EXPECT_LT(validation_error("wiener_hammerstein_WienerHammerBenchmark.csv.gz",
                             "wiener_hammerstein_linear.toml"),
            45e-3);
}
TEST(BenchmarkModels, WienerHammersteinFromItsFilterDesigns) {
  EXPECT_LT(validation_error("wiener_hammerstein_WienerHammerBenchmark.csv.gz",
                             "wiener_hammerstein.toml"),
            0.3e-3);
}
// Told nothing of the filters: all poles at one place, damped, no zeros. The same optimum is found.
TEST(BenchmarkModels, WienerHammersteinFromAGenericStart) {
  EXPECT_LT(
      validation_error("wiener_hammerstein_WienerHammerBenchmark.csv.gz", "wiener_hammerstein.toml",
                       {{"w1", "20000 1/s"},
                        {"w2", "20000 1/s"},
                        {"d2", "1"},
                        {"w3", "20000 1/s"},
                        {"w4", "20000 1/s"},
                        {"d4", "1"},
                        {"m1", "0"},
                        {"m2", "0"}}),
      0.3e-3);
}
}  // namespace
}  // namespace flyball::study::benchmark_models_test
