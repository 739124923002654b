#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/log_error.hpp>
#include <flyball/io/number_table.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/localize_files.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_localize_files = "localize";

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The files of a drive.
struct DriveFiles {
  std::string odometry, wheels, gyro, sightings, landmarks, barcodes, truth;
};

/// What a file is by its name; null where the name says nothing.
std::string DriveFiles::* member_of(const std::string& path) {
  const std::string name = lower(std::filesystem::path(path).filename().string());
  const auto has = [&](std::string_view word) { return name.find(word) != std::string::npos; };
  if (has("wheel")) {
    return &DriveFiles::wheels;
  }
  if (has("gyro")) {
    return &DriveFiles::gyro;
  }
  if (has("odometry")) {
    return &DriveFiles::odometry;
  }
  if (has("landmark")) {
    return &DriveFiles::landmarks;
  }
  if (has("barcode")) {
    return &DriveFiles::barcodes;
  }
  if (has("measurement") || has("sighting")) {
    return &DriveFiles::sightings;
  }
  return has("truth") ? &DriveFiles::truth : nullptr;
}

Expected<std::vector<std::string>> files_of(const LocalizeJob& job) {
  std::vector<std::string> files;
  for (const std::string& path : job.paths) {
    std::error_code error;
    if (!std::filesystem::is_directory(path, error)) {
      files.push_back(path);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(path, error)) {
      if (entry.is_regular_file(error) && member_of(entry.path().string()) != nullptr) {
        files.push_back(entry.path().string());
      }
    }
    if (error) {
      return refusal(ArgumentError::empty, in_localize_files, path)
          .got("a folder that cannot be read: " + error.message())
          .expected("the files of a drive");
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

Expected<DriveFiles> sort_out(const LocalizeJob& job) {
  FLYBALL_TRY(const std::vector<std::string> files, files_of(job));
  DriveFiles drive;
  const std::string robot = lower(job.robot);
  for (const std::string& path : files) {
    const auto member = member_of(path);
    if (std::error_code error; !std::filesystem::exists(path, error)) {
      FLYBALL_CHECK(read_file(path));  // Why it cannot be read.
    }
    if (member == nullptr) {
      return refusal(ArgumentError::unknown_name, in_localize_files, path)
          .got("a name that does not say what it holds")
          .expected(
              "\"odometry\", \"wheel\", \"gyro\", \"measurement\" or \"sighting\", \"landmark\", "
              "\"barcode\" or \"truth\" in it");
    }
    const std::string name = lower(std::filesystem::path(path).filename().string());
    const bool one_robots = member != &DriveFiles::landmarks && member != &DriveFiles::barcodes;
    if (one_robots && !robot.empty() && name.find(robot) == std::string::npos) {
      continue;
    }
    if (!(drive.*member).empty()) {
      return refusal(ArgumentError::ambiguous_name, in_localize_files, path)
          .got("a second file of its kind beside " + drive.*member)
          .expected("one")
          .hint(one_robots ? "name the robot, as its files do: --robot Robot1"
                           : "name the files of one drive");
    }
    drive.*member = path;
  }
  if (!drive.wheels.empty() && !drive.odometry.empty()) {
    return refusal(ArgumentError::ambiguous_name, in_localize_files, drive.wheels)
        .got("beside " + drive.odometry)
        .expected("the odometry once")
        .hint("leave one of them out");
  }
  if (!drive.gyro.empty() && drive.wheels.empty()) {
    return refusal(ArgumentError::empty, in_localize_files, drive.gyro)
        .got("without the wheels' distances")
        .expected("a file whose name says \"wheel\" (time, left, right) beside it")
        .hint("a gyro's turn rate beside a speed is odometry (time, speed, turn rate)");
  }
  std::string& moved = drive.wheels.empty() ? drive.odometry : drive.wheels;
  for (const auto& [path, what] :
       {std::pair(&moved, "odometry (time, speed, turn rate) or wheels (time, left, right)"),
        std::pair(&drive.sightings, "sightings (time, landmark, range, bearing)"),
        std::pair(&drive.landmarks, "landmarks (number, x, y)")}) {
    if (path->empty()) {
      return refusal(ArgumentError::empty, in_localize_files, "the list of files")
          .got(fmt::format("without the {}", what))
          .expected(
              "a file whose name says \"odometry\" or \"wheel\", one that says \"measurement\" or "
              "\"sighting\", and one that says \"landmark\"");
    }
  }
  return drive;
}

Expected<NumberTable> read_table(const std::string& path, std::size_t columns,
                                 std::vector<Diagnostic>& diagnostics) {
  FLYBALL_TRY(const std::string text, read_file(path));
  constexpr std::string_view gzip = "\x1F\x8B";
  if (text.starts_with(gzip)) {
    return refusal(LogError::not_a_log, path, "the file")
        .got("compressed")
        .expected("a table of numbers")
        .hint("unpack it first: gunzip " + path);
  }
  FLYBALL_TRY(NumberTable table, parse_number_table(text, path, columns));
  if (table.cut_line > 0) {
    warn(diagnostics, "truncated", "{}:{}: the file ends within a row, which is left out", path,
         table.cut_line);
  }
  return table;
}

/// Rows in the order of their times; loggers swap neighbours.
void sort_by_time(NumberTable& table, const std::string& path,
                  std::vector<Diagnostic>& diagnostics) {
  const auto earlier = [](const auto& a, const auto& b) { return a[0] < b[0]; };
  if (!std::is_sorted(table.rows.begin(), table.rows.end(), earlier)) {
    std::stable_sort(table.rows.begin(), table.rows.end(), earlier);
    warn(diagnostics, "unsorted", "{}: rows were not in the order of their times and are sorted",
         path);
  }
}

/// The odometry, as it is or from the wheels and the gyro.
Expected<Drive> read_odometry(const DriveFiles& files, const LocalizeJob& job,
                              LocalizeResult& result) {
  Drive drive;
  if (files.wheels.empty()) {
    FLYBALL_TRY(NumberTable odometry, read_table(files.odometry, 3, result.diagnostics));
    sort_by_time(odometry, files.odometry, result.diagnostics);
    for (const auto& row : odometry.rows) {
      result.log.odometry.push_back({row[0], row[1], row[2]});
    }
    return drive;
  }
  drive.has_wheels = true;
  FLYBALL_TRY(NumberTable wheels, read_table(files.wheels, 3, result.diagnostics));
  sort_by_time(wheels, files.wheels, result.diagnostics);
  for (const auto& row : wheels.rows) {
    drive.wheels.wheels.push_back({row[0], row[1], row[2]});
  }
  if (!files.gyro.empty()) {
    FLYBALL_TRY(NumberTable gyro, read_table(files.gyro, 2, result.diagnostics));
    sort_by_time(gyro, files.gyro, result.diagnostics);
    for (const auto& row : gyro.rows) {
      drive.wheels.gyro.push_back({row[0], row[1]});
    }
  } else if (!job.track_width) {
    return refusal(ArgumentError::empty, in_localize_files, "the track width")
        .got("not given")
        .expected(
            "about how far apart the left and the right wheels are, in m, since no gyro is "
            "there")
        .hint("--track-width 0.6");
  }
  FLYBALL_TRY(result.log.odometry, wheel_odometry(drive.wheels, job.track_width.value_or(0.0)));
  return drive;
}

Expected<void> read_log(const DriveFiles& files, LocalizeResult& result) {
  FLYBALL_TRY(const NumberTable landmarks, read_table(files.landmarks, 3, result.diagnostics));
  std::map<long long, std::size_t> by_number;
  for (std::size_t i = 0; i < landmarks.rows.size(); ++i) {
    const auto& row = landmarks.rows[i];
    const long long number = std::llround(row[0]);
    if (!by_number.emplace(number, i).second) {
      return refusal(ArgumentError::ambiguous_name,
                     fmt::format("{}:{}", files.landmarks, landmarks.lines[i]), "the landmark")
          .got(fmt::format("{} for the second time", number))
          .expected("each number once");
    }
    result.log.landmarks.push_back({std::to_string(number), {row[1], row[2]}});
  }
  // A sighting names a landmark, or the barcode on it.
  std::map<long long, long long> by_barcode;
  if (!files.barcodes.empty()) {
    FLYBALL_TRY(const NumberTable barcodes, read_table(files.barcodes, 2, result.diagnostics));
    for (std::size_t i = 0; i < barcodes.rows.size(); ++i) {
      const long long number = std::llround(barcodes.rows[i][0]);
      const long long barcode = std::llround(barcodes.rows[i][1]);
      const auto [at, is_new] = by_barcode.emplace(barcode, number);
      if (!is_new && at->second != number) {
        return refusal(ArgumentError::ambiguous_name,
                       fmt::format("{}:{}", files.barcodes, barcodes.lines[i]), "the barcode")
            .got(fmt::format("{} for {} and for {}", barcode, at->second, number))
            .expected("each barcode for one number");
      }
    }
  }
  FLYBALL_TRY(NumberTable sightings, read_table(files.sightings, 4, result.diagnostics));
  sort_by_time(sightings, files.sightings, result.diagnostics);
  std::size_t unknown = 0;
  std::size_t bad = 0;
  std::size_t beyond_a_turn = 0;
  for (const auto& row : sightings.rows) {
    beyond_a_turn += std::abs(row[3]) > 2.0 * std::numbers::pi ? 1 : 0;
    long long number = std::llround(row[1]);
    if (!by_barcode.empty()) {
      const auto known = by_barcode.find(number);
      if (known == by_barcode.end()) {
        ++unknown;
        continue;
      }
      number = known->second;
    }
    const auto landmark = by_number.find(number);
    if (landmark == by_number.end()) {
      ++result.other_sightings;
    } else if (!(row[2] > 0.0) || !(std::abs(row[3]) <= 2.0 * std::numbers::pi)) {
      ++bad;
    } else {
      result.log.sightings.push_back({row[0], landmark->second, row[2], row[3]});
    }
  }
  if (20 * beyond_a_turn > sightings.rows.size()) {
    return refusal(ArgumentError::wrong_unit, files.sightings, "the column of bearings")
        .got(fmt::format("beyond a full turn in {} of {} rows", beyond_a_turn,
                         sightings.rows.size()))
        .expected("rad")
        .hint("of degrees, divide by 57.3");
  }
  if (unknown > 0) {
    warn(result.diagnostics, "unknown_barcode",
         "{} of {} sightings have a barcode that {} does not list, and are left out", unknown,
         sightings.rows.size(), files.barcodes);
  }
  if (bad > 0) {
    warn(result.diagnostics, "impossible_sighting",
         "{} sightings without a positive range or with a bearing beyond a full turn are left out "
         "(m and rad are expected)",
         bad);
  }
  return {};
}

/// The value that a share of them does not exceed.
double quantile(std::vector<double> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// What no wheeled robot does in s and rad.
Expected<void> check_odometry_units(const std::vector<OdometrySample>& odometry,
                                    const std::string& path) {
  constexpr double longest_period = 2.0;    // s
  constexpr double fastest_turning = 15.0;  // rad/s, most of the time
  constexpr double fastest = 50.0;          // m/s, most of the time
  std::vector<double> apart;
  std::vector<double> turning;
  std::vector<double> speed;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    turning.push_back(std::abs(odometry[i].turn_rate));
    speed.push_back(std::abs(odometry[i].velocity));
    if (i > 0) {
      apart.push_back(odometry[i].time - odometry[i - 1].time);
    }
  }
  if (!apart.empty() && quantile(apart, 0.5) > longest_period) {
    return refusal(ArgumentError::wrong_unit, path, "the column of times")
        .got(fmt::format("{:.4g} apart from row to row", quantile(apart, 0.5)))
        .expected("s, and rows no more than 2 s apart")
        .hint("of milliseconds, divide by 1000");
  }
  if (quantile(turning, 0.9) > fastest_turning) {
    return refusal(ArgumentError::wrong_unit, path, "the column of turn rates")
        .got(fmt::format("above {:.4g} in a tenth of the rows", quantile(turning, 0.9)))
        .expected("rad/s")
        .hint("of degrees per second, divide by 57.3");
  }
  if (quantile(speed, 0.9) > fastest) {
    return refusal(ArgumentError::wrong_unit, path, "the column of speeds")
        .got(fmt::format("above {:.4g} in a tenth of the rows", quantile(speed, 0.9)))
        .expected("m/s")
        .hint("of millimetres per second, divide by 1000");
  }
  return {};
}

Expected<void> read_truth(const std::string& path, LocalizeResult& result) {
  FLYBALL_TRY(NumberTable truth, read_table(path, 4, result.diagnostics));
  sort_by_time(truth, path, result.diagnostics);
  const auto& log = result.log;
  for (const auto& row : truth.rows) {
    if (row[0] >= log.odometry.front().time && row[0] <= log.odometry.back().time) {
      result.truth.time.push_back(row[0]);
      result.truth.pose.emplace_back(row[1], row[2], row[3]);
    }
  }
  if (result.truth.time.empty()) {
    warn(result.diagnostics, "no_common_time",
         "{}: none of its times lies within those of the odometry; nothing is compared with it",
         path);
  }
  return {};
}

}  // namespace

Expected<Drive> read_drive(const LocalizeJob& job, LocalizeResult& result) {
  FLYBALL_TRY(const DriveFiles files, sort_out(job));
  for (const std::string* path : {&files.odometry, &files.wheels, &files.gyro, &files.sightings,
                                  &files.landmarks, &files.barcodes, &files.truth}) {
    if (!path->empty()) {
      result.files.push_back(*path);
    }
  }
  FLYBALL_TRY(Drive drive, read_odometry(files, job, result));
  FLYBALL_CHECK(read_log(files, result));
  FLYBALL_CHECK(
      check_odometry_units(result.log.odometry, drive.has_wheels ? files.wheels : files.odometry));
  if (!files.truth.empty()) {
    FLYBALL_CHECK(read_truth(files.truth, result));
  }
  return drive;
}

}  // namespace flyball::study
