#include <memory>
#include <string>
#include <vector>

#include <flyball/study/localize.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

struct LocalizeOptions {
  CommonOptions common;
  study::LocalizeJob job{};
  std::vector<double> start{};
  std::string filter = "extended";
  double range_std = 0.0;
  double bearing_std = 0.0;
  double track_width = 0.0;
  bool no_calibration = false;
  bool no_smoother = false;
};

constexpr const char* localize_schema = "flyball.localize/1";

int run_localize(const LocalizeOptions& options) {
  const auto result = study::localize(options.job);
  if (!result) {
    return fail(result.error(), options.common, localize_schema);
  }
  return tell(study::answer_of(*result), options.common, false);
}

}  // namespace

void add_localize_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "localize", "Find where a robot was, from its odometry and the landmarks that it saw");
  command->footer(
      "FILES are tables of numbers, told by words in their names: \"odometry\" (time, speed, turn\n"
      "rate), or \"wheel\" (time, left, right: how far they have come) and maybe \"gyro\" (time, "
      "turn\n"
      "rate); \"measurement\" or \"sighting\" (time, landmark or barcode, range, bearing), "
      "\"landmark\"\n"
      "(number, x, y), and where there are any \"barcode\" (number, barcode) and \"truth\" (time, "
      "x,\n"
      "y, heading), with which the paths are compared. Units are s, m, rad.");
  auto options = std::make_shared<LocalizeOptions>();
  command->add_option("FILES", options->job.paths, "The files of a drive, or their folder")
      ->required();
  command->add_option("--robot", options->job.robot,
                      "A part of the names of one robot's files, where there are several");
  CLI::Option* start = command
                           ->add_option("--start", options->start,
                                        "Where it begins: x,y,heading (m, rad); else found")
                           ->delimiter(',')
                           ->expected(3);
  command
      ->add_option("--filter", options->filter,
                   "Which Kalman filter: extended (the default), unscented or invariant")
      ->check(CLI::IsMember({"extended", "unscented", "invariant"}));
  CLI::Option* range = command->add_option("--range-std", options->range_std,
                                           "Standard deviation of a range, m (0.1)");
  CLI::Option* bearing = command->add_option("--bearing-std", options->bearing_std,
                                             "Standard deviation of a bearing, rad (0.03)");
  CLI::Option* track =
      command->add_option("--track-width", options->track_width,
                          "About how far apart left and right wheels are, m; the path tells more");
  command->add_flag("--no-calibration", options->no_calibration,
                    "Take the sensors as they are: no scales, offsets and delay are found");
  command->add_flag("--no-smoother", options->no_smoother, "Only the filter");
  add_common_options(
      *command, options->common,
      "Write a report with the map, and the paths as CSV and WPILOG, into this folder");
  command->callback([=, &invocation] {
    if (start->count() > 0) {
      options->job.start = {options->start[0], options->start[1], options->start[2]};
    }
    if (range->count() > 0) {
      options->job.range_std = options->range_std;
    }
    if (bearing->count() > 0) {
      options->job.bearing_std = options->bearing_std;
    }
    for (const auto method : {LandmarkFilterMethod::unscented, LandmarkFilterMethod::invariant}) {
      options->job.filter =
          study::name_of(method) == options->filter ? method : options->job.filter;
    }
    options->job.calibrate = !options->no_calibration;
    if (track->count() > 0) {
      options->job.track_width = options->track_width;
    }
    options->job.smooth = !options->no_smoother;
    options->common.typed = invocation.typed;
    invocation.status = guarded([&] { return run_localize(*options); }, options->common,
                                localize_schema, options->job.paths.front());
  });
}

}  // namespace flyball::app
