// From a project file to its report, which needs what the installed libraries are linked with.
#include <cstdio>

#include <flyball/report/write_report.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/project.hpp>

constexpr const char* project = R"([mechanism]
type = "flywheel"
motor = "NEO"
gearing = 2.0
moment_of_inertia = "0.001 kg m^2"

[controller]
state_tolerance = ["10 rad/s"]
input_tolerance = "12 V"
)";

int main(int, char** arguments) {
  const auto written =
      flyball::study::parse_project(project, "flywheel.toml")
          .and_then([](const auto& read) { return flyball::study::design(read.job); })
          .and_then([&](const auto& result) {
            return flyball::report::write_report(flyball::study::answer_of(result), arguments[1]);
          });
  if (!written) {
    std::puts(to_string(written.error()).c_str());
  }
  return written ? 0 : 1;
}
