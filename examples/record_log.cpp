// Records a characterisation session of a simulated elevator as a SysId JSON, as dirty as a real
// one: 5 ms rows, an encoder that refreshes each 20 ms, quantisation, a filtered velocity, noise,
// friction. examples/logs/elevator.json is what it writes; elevator_truth.toml holds its truth.
#include <cstdio>

#include <flyball/io/sysid_json.hpp>
#include <flyball/simulation/characterization.hpp>

namespace {

const char* sysid_name(flyball::identification::TestKind kind) {
  using enum flyball::identification::TestKind;
  switch (kind) {
    case quasistatic_forward:
      return "slow-forward";
    case quasistatic_reverse:
      return "slow-backward";
    case dynamic_forward:
      return "fast-forward";
    case dynamic_reverse:
      return "fast-backward";
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  using namespace flyball;
  if (argc != 2) {
    std::fprintf(stderr, "usage: record_log FILE.json\n");
    return 2;
  }
  CharacterizationOptions session;
  session.mechanism = mechanisms::MechanismKind::elevator;
  session.kS = 0.15;
  session.kV = 4.0;
  session.kA = 0.3;
  session.kG = 0.6;
  session.travel_low = 0.0;
  session.travel_high = 1.4;
  session.resolution = 1e-4;
  session.sensor_delay = 0.010;
  session.friction_variation = 0.1;
  session.breakaway = 1.2;
  session.seed = 2024;
  const auto recording = record_characterization(session);
  if (!recording) {
    std::fprintf(stderr, "%s\n", to_string(recording.error()).c_str());
    return 1;
  }

  SysIdJson log;
  log.test = "Elevator";
  log.units = "Meters";
  log.units_per_rotation = 1.0;
  for (const identification::TestRun& run : recording->runs) {
    SysIdJson::Run rows;
    rows.name = sysid_name(run.kind);
    rows.time = run.time;
    rows.voltage = run.voltage;
    rows.position = run.position;
    rows.velocity = run.velocity;
    log.runs.push_back(std::move(rows));
  }
  if (auto written = write_sysid_json(argv[1], log); !written) {
    std::fprintf(stderr, "%s\n", to_string(written.error()).c_str());
    return 2;
  }
}
