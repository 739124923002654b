#include <flyball/study/localize.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/log_error.hpp>

#include "io/temporary_folder.hpp"

namespace flyball::study::localize_test {
namespace {

using Json = nlohmann::json;

const std::string drive = FLYBALL_EXAMPLES "/drive";

/// The example's files in a folder of its own, to be changed.
class Localize : public testing::Test {
 protected:
  void SetUp() override {
    for (const auto& entry : std::filesystem::directory_iterator(drive)) {
      std::filesystem::copy(entry.path(), folder_.file(entry.path().filename().string()));
    }
  }
  void write(const std::string& name, const std::string& text) { folder_.put(name, text); }
  void remove(const std::string& name) { std::filesystem::remove(folder_.file(name)); }
  [[nodiscard]] LocalizeJob job() const { return {.paths = {folder_.file("")}}; }

  template <class Code>
  void expect_refused(Code code, const std::string& words, const LocalizeJob& of) {
    const auto result = localize(of);
    ASSERT_FALSE(result);
    EXPECT_TRUE(result.error().is(code)) << to_string(result.error());
    EXPECT_NE(to_string(result.error()).find(words), std::string::npos)
        << to_string(result.error());
  }

  TemporaryFolder folder_;
};

TEST_F(Localize, FindsTheExamplesPathAndSensors) {
  const auto result = localize({.paths = {drive}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_GT(result->odometry_error->rms, 0.5);
  EXPECT_LT(result->filter_error->rms, 0.15);
  EXPECT_LT(result->smoother_error->rms, 0.03);
  EXPECT_NEAR(result->smoother->calibration.depth_exponent, 1.0, 0.1);
  EXPECT_NEAR(result->smoother->calibration.velocity_scale, 0.96, 0.05);
  const Answer answer = answer_of(*result);
  const Json json = Json::parse(answer.json);
  EXPECT_EQ(json.at("paths").size(), 3U);
  EXPECT_EQ(json.at("paths")[2].at("error").at("rms").get<double>(), result->smoother_error->rms);
  EXPECT_EQ(answer.figures.size(), 3U);
  EXPECT_EQ(answer.files.size(), 4U);
  EXPECT_FALSE(answer.refusal);
  EXPECT_EQ(json.at("filter"), "extended");
  EXPECT_FALSE(json.contains("track_width"));
  // Poses of the plane and of space, which AdvantageScope draws; the last is the truth's.
  const std::string& poses = answer.files.back().contents;
  for (const char* channel : {"/Flyball/smoother", "struct:Pose2d", "/Flyball/smoother_3d",
                              "struct:Pose3d", "/Flyball/truth_3d"}) {
    EXPECT_NE(poses.find(channel), std::string::npos) << channel;
  }
  std::array<double, 7> last{};
  std::memcpy(last.data(), poses.data() + poses.size() - sizeof(last), sizeof(last));
  const Pose2d& end = result->truth.pose.back();
  EXPECT_EQ(last[0], end.x());
  EXPECT_EQ(last[2], 0.0);
  EXPECT_NEAR(last[3], std::cos(0.5 * end.angle()), 1e-15);
  EXPECT_NEAR(last[6], std::sin(0.5 * end.angle()), 1e-15);
}

TEST_F(Localize, TakesEveryFilter) {
  std::vector<double> errors;
  for (const auto method : {LandmarkFilterMethod::extended, LandmarkFilterMethod::unscented,
                            LandmarkFilterMethod::invariant}) {
    const auto result = localize({.paths = {drive}, .filter = method, .smooth = false});
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_LT(result->filter_error->rms, 0.15);
    EXPECT_EQ(Json::parse(answer_of(*result).json).at("filter"), name_of(method));
    errors.push_back(result->filter_error->rms);
  }
  EXPECT_NE(errors[0], errors[1]);
  EXPECT_NE(errors[0], errors[2]);
}

/// The example's drive by the distances of its wheels, `width` apart.
std::string wheels_csv(const LocalizedPath& truth, double width) {
  std::ostringstream text;
  text << "time,left (m),right (m)\n" << std::setprecision(12);
  double left = 0.0;
  double right = 0.0;
  for (std::size_t i = 0; i < truth.time.size(); ++i) {
    if (i > 0) {
      const Eigen::Vector3d moved = truth.pose[i - 1].between(truth.pose[i]).log();
      left += moved(0) - 0.5 * width * moved(2);
      right += moved(0) + 0.5 * width * moved(2);
    }
    text << truth.time[i] << "," << left << "," << right << "\n";
  }
  return text.str();
}

TEST_F(Localize, WheelsTellTheTrackWidth) {
  const auto known = localize(job());
  ASSERT_TRUE(known);
  remove("odometry.csv");
  write("wheels.csv", wheels_csv(known->truth, 0.45));
  LocalizeJob of = job();
  expect_refused(ArgumentError::empty, "--track-width", of);
  of.track_width = 0.5;
  const auto result = localize(of);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_TRUE(result->track_width);
  EXPECT_NEAR(result->track_width->value, 0.45, 3.0 * result->track_width->std);
  EXPECT_LT(result->track_width->std, 0.03);
  const Json json = Json::parse(answer_of(*result).json);
  EXPECT_EQ(json.at("track_width").at("value").get<double>(), result->track_width->value);
  EXPECT_LT(result->smoother_error->rms, 0.03);

  std::ostringstream gyro;
  for (std::size_t i = 0; i + 1 < known->truth.time.size(); ++i) {
    const double dt = known->truth.time[i + 1] - known->truth.time[i];
    gyro << known->truth.time[i] << ","
         << known->truth.pose[i].between(known->truth.pose[i + 1]).angle() / dt - 0.03 << "\n";
  }
  write("gyro.csv", gyro.str());
  of.track_width.reset();
  const auto turned = localize(of);
  ASSERT_TRUE(turned) << to_string(turned.error());
  EXPECT_NEAR(turned->smoother->calibration.gyro_bias, -0.03, 0.01);
  ASSERT_TRUE(turned->track_width);
  EXPECT_NEAR(turned->track_width->value, 0.45, 3.0 * turned->track_width->std);

  remove("wheels.csv");
  expect_refused(ArgumentError::empty, "gyro.csv", of);
  write("odometry.csv", "0,0,0\n");
  write("wheels.csv", "0,0,0\n1,1,1\n");
  expect_refused(ArgumentError::ambiguous_name, "wheels.csv", of);
}

TEST_F(Localize, WithoutTruthCalibrationOrSmootherItAnswersToo) {
  remove("truth.csv");
  LocalizeJob of = job();
  of.calibrate = false;
  of.smooth = false;
  of.start = {-1.0, -0.5, 0.3};
  const auto result = localize(of);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_FALSE(result->filter_error);
  EXPECT_EQ(result->filter.calibration.velocity_scale, 1.0);
  EXPECT_EQ(result->filter.relocalizations, 0);
  EXPECT_EQ(Json::parse(answer_of(*result).json).at("paths").size(), 2U);
}

TEST_F(Localize, FilesThatAreMissingOrTwiceAreNamed) {
  LocalizeJob of = job();
  write("other_odometry.csv", "0,0,0\n");
  expect_refused(ArgumentError::ambiguous_name, "--robot", of);
  remove("other_odometry.csv");
  write("notes.txt", "not of the drive");
  EXPECT_TRUE(localize(of));
  of.paths.push_back(folder_.file("notes.txt"));
  expect_refused(ArgumentError::unknown_name, "notes.txt", of);
  of.paths = {folder_.file("nowhere")};
  expect_refused(FileError::not_found, "nowhere", of);
  remove("landmarks.csv");
  expect_refused(ArgumentError::empty, "landmarks (number, x, y)", job());
}

TEST_F(Localize, WrongRowsAreToldWithTheirLine) {
  write("odometry.csv", "time,v,w\n0,0.1,0\n0.1,0.1\n");
  expect_refused(LogError::malformed, "odometry.csv:3", job());
  write("odometry.csv", "\x1F\x8B compressed");
  expect_refused(LogError::not_a_log, "gunzip", job());
  write("odometry.csv", "");
  expect_refused(LogError::no_data, "odometry.csv", job());
  remove("odometry.csv");
  std::filesystem::copy(drive + "/odometry.csv", folder_.file("odometry.csv"));
  write("landmarks.csv", "1,0,0\n1,2,2\n");
  expect_refused(ArgumentError::ambiguous_name, "landmarks.csv:2", job());
  write("landmarks.csv", "1,0,0\n");
  expect_refused(LocalizationError::too_few_sightings, "two landmarks", job());
}

TEST_F(Localize, WhatIsLeftOutIsTold) {
  write("barcodes.csv", "1,1\n2,2\n3,3\n4,4\n5,5\n6,6\n7,7\n8,8\n9,9\n10,10\n11,11\n20,12\n");
  const auto sightings = read_file(folder_.file("sightings.csv")).value();
  write("sightings.csv", sightings + "90,77,1,0\n90,1,-1,0\n3,2,2.5,0.1\n");
  const auto result = localize(job());
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_GT(result->other_sightings, 0U);  // Barcode 12 is no landmark now.
  std::string codes;
  for (const Diagnostic& diagnostic : result->diagnostics) {
    codes += diagnostic.code + " ";
  }
  for (const char* code : {"unknown_barcode", "impossible_sighting", "unsorted"}) {
    EXPECT_NE(codes.find(code), std::string::npos) << codes;
  }
}

TEST_F(Localize, AFileThatIsCutOffIsReadUpToThere) {
  const auto odometry = read_file(folder_.file("odometry.csv")).value();
  write("odometry.csv", odometry.substr(0, odometry.rfind(',')));
  LocalizeJob of = job();
  of.smooth = false;
  const auto result = localize(of);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->diagnostics.front().code, "truncated");
}

TEST_F(Localize, ContradictionsAreRefused) {
  write("barcodes.csv", "1,11\n2,12\n3,11\n");
  expect_refused(ArgumentError::ambiguous_name, "barcodes.csv:3", job());
  remove("barcodes.csv");
  const auto odometry = read_file(folder_.file("odometry.csv")).value();
  write("odometry.csv", odometry + "1.2e9,0,0\n");
  expect_refused(ArgumentError::out_of_range, "clock", job());
  write("odometry.csv", odometry);
  LocalizeJob of = job();
  of.start = {0.0, std::numeric_limits<double>::quiet_NaN(), 0.0};
  expect_refused(ArgumentError::not_finite, "start", of);
}

/// A column of the example's file in another unit.
std::string scaled(const std::string& name, std::size_t column, double factor) {
  std::istringstream in(read_file(drive + "/" + name).value());
  std::string line;
  std::string out;
  for (bool header = true; std::getline(in, line); header = false) {
    std::istringstream cells(line);
    std::string cell;
    for (std::size_t k = 0; std::getline(cells, cell, ','); ++k) {
      out += (k == 0 ? "" : ",") +
             (k == column && !header ? std::to_string(factor * std::stod(cell)) : cell);
    }
    out += "\n";
  }
  return out;
}

TEST_F(Localize, OtherUnitsAreToldOrFound) {
  constexpr double degrees = 57.29578;
  write("sightings.csv", scaled("sightings.csv", 3, degrees));
  expect_refused(ArgumentError::wrong_unit, "divide by 57.3", job());
  write("sightings.csv", scaled("sightings.csv", 3, 1.0));
  write("odometry.csv", scaled("odometry.csv", 2, degrees));
  expect_refused(ArgumentError::wrong_unit, "turn rates", job());
  write("odometry.csv", scaled("odometry.csv", 1, 1000.0));
  expect_refused(ArgumentError::wrong_unit, "speeds", job());
  write("odometry.csv", scaled("odometry.csv", 0, 1000.0));
  expect_refused(ArgumentError::wrong_unit, "divide by 1000", job());

  const auto told = [](const LocalizeResult& result, const char* code) {
    return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                       [&](const Diagnostic& diagnostic) { return diagnostic.code == code; });
  };
  // Feet per second, and a gyro of the other sense: the path is found, and the constant is told.
  for (const auto& [column, factor] : {std::pair(1, 3.28084), std::pair(2, -1.0)}) {
    write("odometry.csv", scaled("odometry.csv", static_cast<std::size_t>(column), factor));
    const auto result = localize(job());
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_TRUE(told(*result, "implausible_calibration"));
    EXPECT_EQ(answer_of(*result).document.verdict.tone, Tone::caution);
  }
  // Bearings of the other sense, ranges in feet: nothing fits, and nothing is claimed.
  write("odometry.csv", scaled("odometry.csv", 1, 1.0));
  for (const auto& [column, factor] : {std::pair(3, -1.0), std::pair(2, 3.28084)}) {
    write("sightings.csv", scaled("sightings.csv", static_cast<std::size_t>(column), factor));
    const auto result = localize(job());
    if (result) {
      EXPECT_EQ(answer_of(*result).document.verdict.tone, Tone::bad);
    } else {
      EXPECT_TRUE(result.error().is(LocalizationError::too_few_sightings));
    }
  }
}

#ifdef FLYBALL_TEST_DATA
// UTIAS multi-robot data, set 6, robot 1, with motion capture for truth; docs/localization.md.
TEST_F(Localize, TheUtiasRobotIsFound) {
  const std::string data = FLYBALL_TEST_DATA "/benchmarks/";
  if (!std::filesystem::exists(data + "mrclam6_robot1_Odometry.dat.gz")) {
    GTEST_SKIP() << "without the recordings";
  }
  TemporaryFolder unpacked;
  const std::string to = unpacked.file("");
  for (const std::string name : {"Odometry", "Measurement", "Groundtruth_every5th"}) {
    const std::string command = "gzip -cd '" + data + "mrclam6_robot1_" + name + ".dat.gz' > '" +
                                to + "robot1_" + name + ".dat'";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  for (const std::string name : {"mrclam6_Barcodes.dat", "mrclam6_Landmark_Groundtruth.dat"}) {
    std::filesystem::copy(data + name, to + name);
  }
  const auto result = localize({.paths = {to}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_LT(result->filter_error->rms, 0.14);
  EXPECT_LT(result->smoother_error->rms, 0.08);
  EXPECT_LT(result->smoother_error->worst, 0.25);
  EXPECT_NEAR(result->smoother->calibration.depth_exponent, 1.0, 0.15);
  EXPECT_NEAR(result->smoother->calibration.delay, 0.2, 0.06);
  EXPECT_LT(result->smoother_error->nees, 1.2);
  EXPECT_EQ(answer_of(*result).document.verdict.tone, Tone::caution);  // One unknown barcode.

  // A part of it, whose sightings go on after the odometry has ended: the smoother settles.
  const auto first_lines = [&](const char* name, int lines) {
    std::istringstream in(read_file(to + "robot1_" + name + ".dat").value());
    std::string out;
    std::string line;
    for (int k = 0; k < lines && std::getline(in, line); ++k) {
      out += line + "\n";
    }
    return out;
  };
  TemporaryFolder part;
  part.put("Odometry.dat", first_lines("Odometry", 8000));
  part.put("Measurement.dat", first_lines("Measurement", 260));
  part.put("Barcodes.dat", read_file(to + "mrclam6_Barcodes.dat").value());
  part.put("Landmarks.dat", read_file(to + "mrclam6_Landmark_Groundtruth.dat").value());
  const auto of_part = localize({.paths = {part.file("")}});
  ASSERT_TRUE(of_part) << to_string(of_part.error());
  EXPECT_TRUE(of_part->smoother->converged) << of_part->smoother->optimality;

  // The sign of a column, or its unit: never "known", and the mend is told.
  const auto changed = [&](const char* name, std::size_t column, double factor) {
    std::istringstream in(read_file(to + "robot1_" + name + ".dat").value());
    std::string out;
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || line.front() == '#') {
        continue;
      }
      std::istringstream cells(line);
      double cell = 0.0;
      for (std::size_t k = 0; cells >> cell; ++k) {
        out += std::to_string(k == column ? factor * cell : cell) + " ";
      }
      out += "\n";
    }
    return out;
  };
  for (const auto& [name, column, factor, expected] :
       {std::tuple("Measurement", 3, -1.0, "bearings are measured counter-clockwise"),
        std::tuple("Odometry", 2, -1.0, "turn rates are positive counter-clockwise"),
        std::tuple("Odometry", 2, 57.29578, "turn rates are in rad/s")}) {
    const std::string file = std::string("robot1_") + name + ".dat";
    const std::string right = read_file(to + file).value();
    unpacked.put(file, changed(name, static_cast<std::size_t>(column), factor));
    const auto wrong = localize({.paths = {to}, .smooth = false});
    ASSERT_TRUE(wrong) << to_string(wrong.error());
    const auto verdict = answer_of(*wrong).document.verdict;
    EXPECT_EQ(verdict.tone, Tone::bad);
    EXPECT_NE(verdict.line.find("cannot be trusted"), std::string::npos);
    std::string all;
    for (const Diagnostic& diagnostic : wrong->diagnostics) {
      all += diagnostic.code + ": " + diagnostic.message + "\n";
    }
    EXPECT_NE(all.find(expected), std::string::npos) << all;
    EXPECT_NE(all.find("inconsistent"), std::string::npos) << all;
    unpacked.put(file, right);
  }
}
#endif

}  // namespace
}  // namespace flyball::study::localize_test
