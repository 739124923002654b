// A path as tables, pictures and files.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <flyball/export/motion_table.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/path.hpp>

#include "core/wording.hpp"
#include "study/answer/path_parts.hpp"

namespace flyball::study {

namespace {

using text::number;

constexpr const char* path_schema = "flyball.path/1";

/// The largest of what samples have.
struct Peaks {
  double speed = 0.0, omega = 0.0, acceleration = 0.0;
};

Peaks peaks_of(const PathResult& result) {
  Peaks peaks;
  for (const MotionSample& sample : result.trajectory.samples) {
    peaks.speed = std::max(peaks.speed, sample.velocity.norm());
    peaks.omega = std::max(peaks.omega, std::abs(sample.omega));
    peaks.acceleration = std::max(peaks.acceleration, sample.acceleration.norm());
  }
  return peaks;
}

std::string to_json(const PathResult& result) {
  const Peaks peaks = peaks_of(result);
  JsonWriter json;
  json.object([&] {
    json.add("schema", path_schema);
    json.add("files", result.parts);
    json.add("timed", result.timed);
    json.add("holonomic", result.trajectory.holonomic);
    json.add({{"length", result.length},
              {"duration", result.trajectory.duration()},
              {"peak_speed", peaks.speed},
              {"peak_turning_rate", peaks.omega},
              {"peak_acceleration", peaks.acceleration}});
    if (!result.fastest_wheel.empty()) {
      json.add({{"peak_wheel_speed",
                 *std::max_element(result.fastest_wheel.begin(), result.fastest_wheel.end())},
                {"wheel_speed_limit", result.wheel_limit}});
    }
    json.list("binding", result.binding, [&](const PathBinding& binding) {
      json.object([&] {
        json.add({{"from", binding.from}, {"to", binding.to}});
        json.add("limit", binding.limit);
      });
    });
    json.list("events", result.events, [&](const PathEvent& event) {
      json.object([&] {
        json.add("name", event.name);
        json.add({{"time", event.time}});
        if (event.end) {
          json.add({{"end", *event.end}});
        }
      });
    });
    json.list("samples", result.trajectory.samples, [&](const MotionSample& sample) {
      json.object([&] {
        json.add({{"time", sample.time},
                  {"x", sample.pose.x()},
                  {"y", sample.pose.y()},
                  {"heading", sample.pose.angle()},
                  {"vx", sample.velocity(0)},
                  {"vy", sample.velocity(1)},
                  {"omega", sample.omega},
                  {"ax", sample.acceleration(0)},
                  {"ay", sample.acceleration(1)}});
      });
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Table binding_table(const PathResult& result) {
  Table table{.caption = "What holds it back",
              .header = {"limit", "time (s)", "of the whole", "first from", "to"},
              .words = {0}};
  struct Share {
    std::string limit;
    double time = 0.0, from = 0.0, to = 0.0;
  };
  std::vector<Share> shares;
  for (const PathBinding& binding : result.binding) {
    auto found = std::find_if(shares.begin(), shares.end(),
                              [&](const Share& share) { return share.limit == binding.limit; });
    if (found == shares.end()) {
      shares.push_back({binding.limit, 0.0, binding.from, binding.to});
      found = std::prev(shares.end());
    }
    found->time += binding.to - binding.from;
  }
  std::stable_sort(shares.begin(), shares.end(),
                   [](const Share& a, const Share& b) { return a.time > b.time; });
  for (const Share& share : shares) {
    table.rows.push_back({share.limit, quantity(share.time, "s", 3, false),
                          text::percent(share.time / result.trajectory.duration()),
                          quantity(share.from, "s", 3, false), quantity(share.to, "s", 3, false)});
  }
  return table;
}

std::string stem_of(const std::string& file) {
  return std::filesystem::path(file).filename().string();
}

}  // namespace

Answer answer_of(const PathResult& result) {
  Answer answer{.schema = path_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = "Path";
  const double duration = result.trajectory.duration();
  document.verdict.line = fmt::format("{} m in {} s.", number(result.length), number(duration));
  if (result.timed && !result.binding.empty()) {
    std::map<std::string, double> shares;
    for (const PathBinding& binding : result.binding) {
      shares[binding.limit] += binding.to - binding.from;
    }
    const auto most =
        std::max_element(shares.begin(), shares.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    document.verdict.line +=
        fmt::format(" {} holds it back {} of the time.", text::capitalized(most->first),
                    text::percent(most->second / duration));
  }
  for (const Diagnostic& diagnostic : result.diagnostics) {
    if (diagnostic.severity != Severity::info) {
      document.verdict.add(Tone::caution, diagnostic.message);
    }
  }
  const Peaks peaks = peaks_of(result);
  Section field{"field", "The path", {}};
  Facts facts;
  facts.add("length", quantity(result.length, "m", 5));
  facts.add("duration", quantity(duration, "s", 5));
  facts.add("the robot",
            result.trajectory.holonomic ? "looks another way than it goes" : "looks where it goes");
  facts.add("times", result.timed ? "made here, by the limits" : "as the file has them");
  facts.add("largest speed", quantity(peaks.speed, "m/s"));
  facts.add("largest turning rate", quantity(peaks.omega, "rad/s"));
  facts.add("largest acceleration", quantity(peaks.acceleration, "m/s²"));
  if (!result.fastest_wheel.empty()) {
    facts.add("fastest wheel",
              quantity(*std::max_element(result.fastest_wheel.begin(), result.fastest_wheel.end()),
                       "m/s"));
    facts.add("wheels without load", quantity(result.wheel_limit, "m/s"));
  }
  field.blocks.emplace_back(std::move(facts));
  document.sections.push_back(std::move(field));
  Section motion{"motion", "Over time", {}};
  if (!result.binding.empty()) {
    motion.blocks.emplace_back(binding_table(result));
  }
  Table table{.caption = "Ten instants of it",
              .header = {"time (s)", "x (m)", "y (m)", "heading (rad)", "speed (m/s)",
                         "turning rate (rad/s)"},
              .words = {}};
  constexpr int shown = 10;
  for (int k = 0; k <= shown; ++k) {
    const MotionSample sample = result.trajectory.at(duration * k / shown);
    table.rows.push_back(
        {quantity(sample.time, "s", 4, false), quantity(sample.pose.x(), "m", 4, false),
         quantity(sample.pose.y(), "m", 4, false), quantity(sample.pose.angle(), "rad", 4, false),
         quantity(sample.velocity.norm(), "m/s", 4, false),
         quantity(sample.omega, "rad/s", 4, false)});
  }
  motion.blocks.emplace_back(std::move(table));
  if (!result.events.empty()) {
    Table events{.caption = "What happens along it",
                 .header = {"event", "time (s)", "until (s)"},
                 .words = {0}};
    for (const PathEvent& event : result.events) {
      events.rows.push_back({event.name, quantity(event.time, "s", 4, false),
                             event.end ? quantity(*event.end, "s", 4, false) : ""});
    }
    motion.blocks.emplace_back(std::move(events));
  }
  document.sections.push_back(std::move(motion));
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  std::vector<std::string> names;
  for (const std::string& part : result.parts) {
    names.push_back(stem_of(part));
  }
  document.origins.add(names.size() > 1 ? "files" : "file", text::enumerate(names));
  answer.figures = path_figures(result);
  answer.animations = {path_animation(result)};
  const std::string name =
      names.empty() ? std::string("path") : std::filesystem::path(names.front()).stem().string();
  if (const auto series = to_table(result.trajectory)) {
    answer.files.push_back({"data/path.csv", to_csv(*series)});
    if (const auto header = exports::motion_table(*series, "path", "A trajectory of " + name,
                                                  exports::motion_rates)) {
      answer.files.push_back({"path.hpp", *header});
    }
  }
  if (const auto file = to_wpilib(to_wpilib_trajectory(result.trajectory))) {
    answer.files.push_back({"path.wpilib.json", *file});
  }
  const bool differential =
      result.robot ? result.robot->kind == DriveKind::differential : result.job.differential;
  if (!differential || !result.trajectory.holonomic) {
    std::vector<Diagnostic> left_out;
    if (const auto file = to_choreo(choreo_trajectory(result, "path", left_out))) {
      answer.files.push_back({"path.traj", *file});
    }
  }
  return answer;
}

}  // namespace flyball::study
