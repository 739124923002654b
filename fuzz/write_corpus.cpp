#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/quantity.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/motion/choreo.hpp>
#include <flyball/io/motion/pathplanner.hpp>
#include <flyball/io/motion/wpilib_trajectory.hpp>
#include <flyball/io/sysid_json.hpp>
#include <flyball/io/wpilog.hpp>
#include <flyball/recording/motion_file.hpp>
#include <flyball/solve/kind.hpp>
#include <flyball/study/project.hpp>

/// Writes the seeds and dictionaries of the fuzzers: fuzz/corpus/<entry>/* and
/// fuzz/dictionaries/<entry>.dict, from Flyball's own writers and tables.
namespace {

using namespace flyball;

class Folder {
 public:
  explicit Folder(std::filesystem::path path) : path_(std::move(path)) {
    std::filesystem::create_directories(path_);
  }
  void write(const std::string& name, std::string_view bytes) const {
    std::ofstream file(path_ / name, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!file) {
      std::fprintf(stderr, "cannot write %s\n", (path_ / name).c_str());
      std::exit(1);
    }
  }

 private:
  std::filesystem::path path_;
};

/// As libFuzzer reads it: one quoted word a line.
std::string dictionary(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    text += '"';
    for (const char c : word) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') {
        text += '\\';
        text += c;
      } else if (byte < 0x20 || byte >= 0x7f) {
        char hex[8];
        std::snprintf(hex, sizeof hex, "\\x%02x", byte);
        text += hex;
      } else {
        text += c;
      }
    }
    text += "\"\n";
  }
  return text;
}

const std::vector<std::string> json_words{"[[",    "]]",    "],[",    "null",    "true",
                                          "1e308", "-0.0",  "5e-324", "\"inf\"", "\\u0000",
                                          "NaN",   "1e999", "{\"",    "\":"};

SysIdJson example_sysid(bool drive) {
  SysIdJson log;
  log.layout = drive ? SysIdJson::Layout::drive : SysIdJson::Layout::mechanism;
  log.test = drive ? "Drivetrain" : "Elevator";
  log.units = "Meters";
  log.units_per_rotation = 0.1144;
  for (const char* name : {"slow-forward", "slow-backward", "fast-forward", "fast-backward"}) {
    SysIdJson::Run run;
    run.name = name;
    for (int i = 0; i < 3; ++i) {
      const double t = 0.005 * i;
      for (std::vector<double>* column : {&run.time, &run.voltage, &run.position, &run.velocity}) {
        column->push_back(t);
      }
      if (drive) {
        for (std::vector<double>* column : {&run.right_voltage, &run.right_position,
                                            &run.right_velocity, &run.angle, &run.angle_rate}) {
          column->push_back(t);
        }
      }
    }
    log.runs.push_back(run);
  }
  return log;
}

std::string example_wpilog() {
  WpilogWriter writer;
  const auto number = writer.start("voltage", "double", "Volt");
  const auto text = writer.start("state", "string");
  const auto list = writer.start("list", "double[]", R"({"unit":"meters"})");
  const auto flags = writer.start("flags", "boolean[]");
  const auto whole = writer.start("count", "int64");
  const auto single = writer.start("single", "float");
  for (int i = 0; i < 3; ++i) {
    writer.append(number, i, 0.5 * i);
    writer.append(text, i, i % 2 == 0 ? "none" : "quasistatic-forward");
    writer.append(list, i, std::vector<double>(2, i));
    writer.append_raw(flags, i, std::string(3, '\1'));
    writer.append(whole, i, std::int64_t{i});
    writer.append(single, i, 0.25F);
  }
  writer.finish(text, 4.0);
  writer.set_metadata(number, "Volts", 4.0);
  return writer.bytes();
}

void write_logs(const std::filesystem::path& corpus, const Folder& dictionaries) {
  const Folder sysid(corpus / "sysid_json");
  sysid.write("mechanism", to_sysid_json(example_sysid(false)).value());
  sysid.write("drive", to_sysid_json(example_sysid(true)).value());
  std::vector<std::string> words = json_words;
  words.insert(words.end(), {"slow-forward", "fast-backward", "test", "units", "unitsPerRotation",
                             "sysid", "Elevator", "Drivetrain", "Meters"});
  dictionaries.write("sysid_json.dict", dictionary(words));

  Folder(corpus / "wpilog").write("all", example_wpilog());
  dictionaries.write("wpilog.dict",
                     dictionary({"WPILOG", std::string("\0\1", 2), "double", "double[]", "int64",
                                 "boolean[]", "string", "json", "float", "struct:Pose2d", "unit",
                                 std::string("\xff\xff\xff\xff", 4), std::string("\0\0\0\0", 4)}));

  const Folder csv(corpus / "csv");
  TimeSeries series({0.0, 0.1, 0.2});
  (void)series.add("velocity", "m/s", {1.5, -2.25, 1e-3});
  (void)series.add("a \"quoted\", one", "V", {12, 11.5, std::nan("")});
  csv.write("series", to_csv(series));
  csv.write("list", "Timestamp,Key,Value\n0.1,/v,1.5\n0.2,/state,none\n0.3,/v,2.5\n");
  csv.write("semicolons", "Zeit;Spannung [V]\r\nt (ms);x\r\n1,5;2,5\r\n2,5;-1e3\r\n");
  dictionaries.write("csv.dict", dictionary({"Timestamp", "Time", "time (s)", "(ms)", "[V]", ";",
                                             "\t", "\r\n", "\"\"", "\xef\xbb\xbf", "#", "nan",
                                             "inf", "true", "1e308", "Key", "Value", "1,5"}));

  const Folder streams(corpus / "streams");
  streams.write("series.csv", to_csv(series));
  streams.write(
      "rows.csv",
      "# robot\ntime (ms),state,\"a, b\",x\r\n0,none,1,null\r\n5,\"dynamic-forward\",,2\n");
  streams.write("mechanism.json", to_sysid_json(example_sysid(false)).value());
  streams.write("all.wpilog", example_wpilog());
  words.insert(words.end(), {"WPILOG", std::string("\0\1", 2), "double", "string", "int64",
                             std::string("\0\0\0\0", 4), "time (ms)", "\r\n", "#", "\"\"", ";"});
  dictionaries.write("streams.dict", dictionary(words));
}

void write_problems(const std::filesystem::path& corpus, const Folder& dictionaries) {
  const Folder solve(corpus / "solve");
  std::vector<std::string> words = json_words;
  const auto add = [&](std::string_view word) {
    if (std::find(words.begin(), words.end(), word) == words.end()) {
      words.emplace_back(word);
    }
  };
  std::size_t number = 0;
  for (const solve::Kind& kind : solve::kinds()) {
    std::string bytes{static_cast<char>(number++), '\1'};
    solve.write(std::string(kind.name), bytes + std::string(kind.example));
    bytes[1] = '\0';
    for (int k = 0; k < 96; ++k) {
      bytes += static_cast<char>((k * 37 + static_cast<int>(number) * 11) % 251);
    }
    solve.write(std::string(kind.name) + "_made", bytes);
    for (const solve::Field& field : kind.fields) {
      add("\"" + std::string(field.name) + "\":");
      if (!field.choices.empty()) {
        add("\"" + std::string(field.choices.substr(0, field.choices.find(' '))) + "\"");
        add("\"" + std::string(field.choices.substr(field.choices.rfind(' ') + 1)) + "\"");
      }
    }
  }
  dictionaries.write("solve.dict", dictionary(words));

  const Folder model(corpus / "model");
  model.write("continuous",
              R"--({"A": [[0, 1], [-4, -2]], "B": [[0], [4]], "C": [[1, 0]], "T": 0.02,
"states": ["position (m)", "velocity (m/s)"]})--");
  model.write("discrete", R"({"A": 0.5, "B": 1, "domain": "discrete", "T": 0.1})");
  words = json_words;
  words.insert(words.end(), {"\"A\":", "\"B\":", "\"C\":", "\"D\":", "\"domain\":", "\"T\":",
                             "\"states\":", "\"inputs\":", "\"outputs\":", "\"discrete\""});
  dictionaries.write("model.dict", dictionary(words));
}

/// A motion in all formats of planning tools.
void write_motions(const std::filesystem::path& corpus, const Folder& dictionaries) {
  RobotTrajectory motion;
  for (int i = 0; i < 3; ++i) {
    const double t = 0.5 * i;
    MotionSample sample{.time = t, .pose = Pose2d(1.0 + t * t, 2.0, 0.25 * t)};
    sample.velocity = {2.0 * t, 0.0};
    sample.acceleration = {2.0, 0.0};
    sample.omega = 0.25;
    motion.samples.push_back(sample);
  }
  motion.holonomic = true;
  const Folder folder(corpus / "motion");
  ChoreoTrajectory choreo = to_choreo_trajectory(motion, "lob");
  AutoCommand group{.type = "sequential"};
  group.commands.push_back({.type = "named", .name = "spin"});
  group.commands.push_back({.type = "wait", .wait = {0.5, "0.5 s", {}}});
  choreo.events.push_back({.name = "spin", .target = 0, .target_timestamp = 0.0, .command = group});
  choreo.params.constraints.push_back({.from = "first",
                                       .to = "1",
                                       .type = "MaxVelocity",
                                       .props = {{"max", {3.0, "3 m / s", {}}}}});
  folder.write("choreo", to_choreo(choreo).value());
  folder.write("choreo_sides",
               to_choreo(to_choreo_trajectory(motion, "s", ChoreoSides{0.6})).value());
  folder.write("wpilib", to_wpilib(to_wpilib_trajectory(motion)).value());
  WpilibTrajectory samples = to_wpilib_trajectory(motion);
  samples.is_object = true;
  folder.write("wpilib_2027", to_wpilib(samples).value());
  PathPlannerPath path;
  path.version = "2025.0";
  path.waypoints.resize(2);
  path.waypoints[0].next_control = PlannerPoint{1.0, 0.0};
  path.waypoints[1].anchor = {3.0, 1.0};
  path.waypoints[1].previous_control = PlannerPoint{2.0, 1.0};
  path.rotation_targets.push_back({0.5, 90.0});
  path.zones.push_back({.name = "slow", .from = 0.2, .to = 0.4});
  path.markers.push_back({.name = "m", .position = 0.5, .command = group});
  path.goal_end_state = PathPlannerState{};
  folder.write("path", to_pathplanner(path).value());
  folder.write("auto",
               to_pathplanner(PathPlannerAuto{.version = "2025.0", .command = group}).value());
  PathPlannerGrid grid;
  grid.rows = {{true, false}, {false, true}};
  folder.write("grid", to_pathplanner(grid).value());
  std::vector<std::string> words = json_words;
  for (const char* word : {"samples",
                           "timestamp",
                           "velocityX",
                           "angularVelocity",
                           "trajectory",
                           "params",
                           "waypoints",
                           "constraints",
                           "data",
                           "type",
                           "props",
                           "exp",
                           "val",
                           "events",
                           "from",
                           "target",
                           "version",
                           "anchor",
                           "anchorPoint",
                           "nextControl",
                           "prevControl",
                           "globalConstraints",
                           "command",
                           "commands",
                           "wait",
                           "waitTime",
                           "grid",
                           "field_size",
                           "pose",
                           "translation",
                           "rotation",
                           "radians",
                           "robotConfiguration",
                           "paths",
                           "config",
                           "splits",
                           "sampleType"}) {
    words.push_back("\"" + std::string(word) + "\":");
  }
  dictionaries.write("motion.dict", dictionary(words));
}

void write_projects(const std::filesystem::path& corpus, const Folder& dictionaries) {
  const Folder projects(corpus / "project");
  projects.write("mechanism", R"([mechanism]
type = "elevator"
motor = "NEO"
motor_count = 2
gearing = 10.0
mass = "8 kg"
drum_radius = "1 in"

[controller]
period = "20 ms"
state_tolerance = ["2 cm", "0.4 m/s"]
input_tolerance = "12 V"
)");
  projects.write("gains", R"([mechanism]
type = "flywheel"
[gains]
kS = 0.1
kV = 0.02
kA = 0.003
)");
  projects.write("model", R"--([model]
name = "pendulum"
[model.states]
theta = "rad"
omega = "rad/s"
[model.inputs]
tau = "N m"
[model.parameters]
m = "0.5 kg"
l = "0.3 m"
[model.derivative]
theta = "omega"
omega = "-9.8/l*sin(theta) + tau/(m*l^2)"
[point]
theta = "pi"
[controller]
period = "20 ms"
[controller.tolerance]
theta = "5 deg"
omega = "1 rad/s"
tau = "2 N m"
)--");
  std::vector<std::string> words{
      "\"\"\"", "'''", "[[",    "]]", "= [",        "#",    "\\u0000",
      "inf",    "nan", "1e308", "0x", "1979-05-27", "true", "[mechanism.motor]"};
  const auto add = [&](const std::string& word) {
    if (std::find(words.begin(), words.end(), word) == words.end()) {
      words.push_back(word);
    }
  };
  for (const study::JobKind job :
       {study::JobKind::identify, study::JobKind::design, study::JobKind::tune,
        study::JobKind::analyze, study::JobKind::simulate}) {
    for (const study::FieldInfo& field : study::fields_of(job)) {
      add("[" + field.section + "]");
      add(field.key + " = ");
      add("\"" + field.example + "\"");
    }
  }
  dictionaries.write("project.dict", dictionary(words));
}

void write_texts(const std::filesystem::path& corpus, const Folder& dictionaries) {
  const Folder quantities(corpus / "quantity");
  std::vector<std::string> units{"e",  "1e308", "-", "+", ".",     "\xc2\xb5", "\xc2\xb7", "/",
                                 "^2", "**",    "(", ")", " per ", "m",        "k"};
  for (int d = 0; d <= static_cast<int>(Dimension::frequency); ++d) {
    const auto dimension = static_cast<Dimension>(d);
    quantities.write(std::to_string(d), static_cast<char>(d) + to_text(2.5, dimension));
    units.emplace_back(si_unit(dimension).empty() ? "deg" : si_unit(dimension));
  }
  units.insert(units.end(), {"lb", "in", "ft", "rpm", "rot", "mm", "oz", "hour", "Rotation"});
  dictionaries.write("quantity.dict", dictionary(units));

  const Folder formulas(corpus / "formula");
  formulas.write("pendulum", "a: -g/l*sin(theta)\na + k*u\nif(x > 0, v^2, -v**2)");
  formulas.write("functions",
                 "atan2(x, x)\nhypot(v, v, v)\nclamp(x, -x, 2*x)\nmod(theta, tau)\n"
                 "remainder(theta, 2*pi)\nsqrt(x*x) + cbrt(x³)\nlog1p(u) + erf(u)\n"
                 "x < 0 and not (v >= 0) ? 1 : u");
  dictionaries.write(
      "formula.dict",
      dictionary({"sin(",   "cos(",       "atan2(", "exp(",   "log(",   "sqrt(", "cbrt(", "pow(",
                  "hypot(", "abs(",       "sign(",  "floor(", "round(", "min(",  "max(",  "clamp(",
                  "mod(",   "remainder(", "erf(",   "if(",    "**",     "²",     "≤",     "≠",
                  "and",    "or",         "not",    "? 1 : ", "pi",     "theta", "a: ",   "1e308",
                  "&&",     "||",         "==",     "·",      "−",      "\n"}));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: write_corpus FOLDER\n");
    return 2;
  }
  const std::filesystem::path root(argv[1]);
  const Folder dictionaries(root / "dictionaries");
  const std::filesystem::path corpus = root / "corpus";
  write_logs(corpus, dictionaries);
  write_problems(corpus, dictionaries);
  write_motions(corpus, dictionaries);
  write_projects(corpus, dictionaries);
  write_texts(corpus, dictionaries);
  return 0;
}
