// Writes a folder of simulated logs, for `flyball identify FOLDER`.
//
// usage: write_logs FOLDER COUNT [FIRST_SEED]
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include <flyball/io/sysid_json.hpp>

#include "scenarios.hpp"

namespace {

using namespace flyball;

const char* sysid_name(identification::TestKind kind) {
  constexpr const char* names[] = {"slow-forward", "slow-backward", "fast-forward",
                                   "fast-backward"};
  return names[static_cast<int>(kind)];
}

bool write_log(const std::string& path, const scenarios::Truth& truth, std::uint64_t seed) {
  const auto recording = record_characterization(scenarios::session(truth, seed));
  if (!recording) {
    return false;
  }
  const bool elevator = truth.kind == mechanisms::MechanismKind::elevator;
  SysIdJson log;
  log.test = elevator                                       ? "Elevator"
             : truth.kind == mechanisms::MechanismKind::arm ? "Arm"
                                                            : "Simple";
  log.units = elevator ? "Meters" : "Radians";
  log.units_per_rotation = elevator ? 1.0 : 2.0 * std::numbers::pi;
  for (const identification::TestRun& run : recording->runs) {
    SysIdJson::Run rows;
    rows.name = sysid_name(run.kind);
    rows.time = run.time;
    rows.voltage = run.voltage;
    rows.position = run.position;
    rows.velocity = run.velocity;
    for (auto* column : {&rows.position, &rows.velocity}) {
      for (double& value : *column) {
        value /= *log.units_per_rotation;
      }
    }
    log.runs.push_back(std::move(rows));
  }
  return write_sysid_json(path, log).has_value();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: write_logs FOLDER COUNT [FIRST_SEED]\n");
    return 2;
  }
  const std::string folder = argv[1];
  const auto count = std::strtoull(argv[2], nullptr, 10);
  const std::uint64_t first = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
  std::filesystem::create_directories(folder);
  for (std::uint64_t i = 0; i < count; ++i) {
    const scenarios::Truth& truth = scenarios::mechanisms[i % scenarios::mechanisms.size()];
    const std::string path = fmt::format("{}/{:06}.json", folder, i);
    if (!write_log(path, truth, first + i)) {
      fmt::print(stderr, "{} cannot be written\n", path);
      return 1;
    }
  }
  return 0;
}
