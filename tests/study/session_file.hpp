#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include <flyball/io/sysid_json.hpp>
#include <flyball/simulation/characterization.hpp>

namespace flyball::study {

inline const char* sysid_name(identification::TestKind kind) {
  constexpr const char* names[] = {"slow-forward", "slow-backward", "fast-forward",
                                   "fast-backward"};
  return names[static_cast<int>(kind)];
}

/// A simulated session in a file of its own, removed with it.
class SessionFile {
 public:
  SessionFile(const CharacterizationOptions& session, const std::string& test,
              const std::string& name, std::optional<std::string> units = std::nullopt)
      : path_((std::filesystem::temp_directory_path() / name).string()) {
    const auto recording = record_characterization(session);
    EXPECT_TRUE(recording);
    SysIdJson log;
    log.test = test;
    log.units = units.value_or(test == "Elevator" ? "Meters" : "Radians");
    log.units_per_rotation = 1.0;
    for (const identification::TestRun& run : recording->runs) {
      SysIdJson::Run rows;
      rows.name = sysid_name(run.kind);
      rows.time = run.time;
      rows.voltage = run.voltage;
      rows.position = run.position;
      rows.velocity = run.velocity;
      log.runs.push_back(rows);
    }
    EXPECT_TRUE(write_sysid_json(path_, log));
  }
  ~SessionFile() { std::filesystem::remove(path_); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace flyball::study
