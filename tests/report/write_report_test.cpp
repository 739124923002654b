#include <flyball/report/write_report.hpp>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/wpilog.hpp>
#include <flyball/study/project.hpp>

#include "fixtures.hpp"
#include "report/pictures.hpp"

namespace flyball::report::write_report_test {
namespace {

namespace fs = std::filesystem;

class WriteReport : public ::testing::Test {
 protected:
  WriteReport() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::temp_directory_path() /
            (std::string("flyball_report_") + test->name() + "_" + std::to_string(::getpid()));
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~WriteReport() override { fs::remove_all(root_); }

  [[nodiscard]] std::string folder(const std::string& name = "out") const {
    return (root_ / name).string();
  }

  static std::set<std::string> files_in(const std::string& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) {
        names.insert(fs::relative(entry.path(), folder).string());
      }
    }
    return names;
  }

 private:
  fs::path root_;
};

/// The report of a result's answer.
template <class Result>
Expected<WrittenReport> write(const Result& result, const std::string& folder,
                              const Provenance& provenance = {}) {
  return write_report(study::answer_of(result), folder, provenance);
}

std::string text_of(const std::string& path) {
  return read_file(path).value();
}

TEST_F(WriteReport, HoldsEverythingThatATuneGives) {
  const study::TuneResult result = tune_result(MechanismKind::elevator);
  const auto written = write(result, folder());
  ASSERT_TRUE(written) << to_string(written.error());
  const std::set<std::string> files = files_in(folder());
  for (const char* name : {"index.html",
                           "result.json",
                           "gains.toml",
                           "ElevatorLoop.hpp",
                           "ElevatorLoop.java",
                           "elevator_loop.py",
                           "data/closed_loop.csv",
                           "data/robustness.csv",
                           "data/run_1_quasistatic-forward.csv",
                           "data/run_4_dynamic-reverse.csv",
                           "data/signals.wpilog",
                           "pictures/closed_loop.png",
                           "pictures/closed_loop.svg",
                           "pictures/poles.png",
                           "pictures/estimate.svg",
                           "pictures/fit_1_quasistatic-forward.png",
                           "constants/wpilib_cpp.txt",
                           "constants/wpilib_java.txt",
                           "constants/wpilib_python.txt",
                           "constants/phoenix6_cpp.txt",
                           "constants/phoenix6_java.txt",
                           "constants/revlib_cpp.txt",
                           "constants/revlib_java.txt"}) {
    EXPECT_EQ(files.count(name), 1u) << name;
  }
  EXPECT_EQ(text_of(folder() + "/pictures/poles.png").substr(1, 3), "PNG");
  EXPECT_EQ(text_of(folder() + "/result.json"), study::to_json(result) + "\n");
  // Every link of the page leads to a file, and every file is linked.
  const std::string page = text_of(folder() + "/index.html");
  for (const std::string& name : files) {
    if (name != "index.html" && name[0] != '.') {
      EXPECT_NE(page.find("<a href=\"" + name + "\">"), std::string::npos) << name;
    }
  }
}

TEST_F(WriteReport, TablesReadBackAsTheyWere) {
  const study::TuneResult result = tune_result(MechanismKind::arm);
  ASSERT_TRUE(write(result, folder()));
  const TimeSeries& response = (*result.design)->response;
  const auto csv = parse_csv(text_of(folder() + "/data/closed_loop.csv"), "closed_loop.csv");
  ASSERT_TRUE(csv) << to_string(csv.error());
  for (const TimeSeries::Column& column : response.columns()) {
    const Signal* signal = csv->find_signal(column.name);
    ASSERT_NE(signal, nullptr) << column.name;
    EXPECT_EQ(signal->value, column.values) << column.name;
  }
  const identification::FittedRun& run = result.identification.report.fit->runs.front();
  const auto data = parse_csv(text_of(folder() + "/data/run_1_quasistatic-forward.csv"), "run.csv");
  ASSERT_TRUE(data) << to_string(data.error());
  EXPECT_EQ(data->find_signal("velocity")->value, run.velocity);
  EXPECT_EQ(data->find_signal("velocity_simulated")->value, run.velocity_hat);

  // The same in one log, with the name of the test; runs that begin at zero each stand one after
  // another.
  const auto log = parse_wpilog(text_of(folder() + "/data/signals.wpilog"), "signals.wpilog");
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_TRUE(log->diagnostics.empty());
  const Signal* simulated = log->find_signal("flyball/velocity_simulated");
  ASSERT_NE(simulated, nullptr);
  EXPECT_EQ(simulated->unit, "rad/s");
  std::size_t row = 0;
  double end = -1.0;
  for (const identification::FittedRun& fitted : result.identification.report.fit->runs) {
    const double shift = simulated->time[row] - fitted.time.front();
    EXPECT_GT(simulated->time[row], end);
    for (std::size_t i = 0; i < fitted.time.size(); ++i, ++row) {
      end = simulated->time[row];
      EXPECT_NEAR(end, fitted.time[i] + shift, 2e-6);
      EXPECT_EQ(simulated->value[row], fitted.velocity_hat[i]);
    }
  }
  EXPECT_EQ(simulated->value.size(), row);
  const TextSignal* test = log->find_text("flyball/test");
  ASSERT_NE(test, nullptr);
  ASSERT_EQ(test->value.size(), 8u);
  EXPECT_EQ(test->value[0], "quasistatic-forward");
  EXPECT_EQ(test->value[1], "none");
}

TEST_F(WriteReport, GainsAreAProjectThatGivesTheSameDesign) {
  for (const bool kA_determined : {true, false}) {
    for (const MechanismKind kind :
         {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
      const study::DesignResult design = design_result(kind, kA_determined);
      const std::string where = folder(std::string(to_string(kind)) + (kA_determined ? "" : "0"));
      ASSERT_TRUE(write(design, where));
      const auto project = study::parse_project(text_of(where + "/gains.toml"), "gains.toml");
      ASSERT_TRUE(project) << to_string(project.error());
      ASSERT_FALSE(project->plant_error) << to_string(*project->plant_error);
      const auto again = study::design(project->job);
      ASSERT_TRUE(again) << to_string(again.error());
      EXPECT_EQ(again->K_delayed, design.K_delayed);
      EXPECT_EQ(again->kalman_gain, design.kalman_gain);
      EXPECT_EQ(again->motion.goal, design.motion.goal);
    }
  }
}

TEST_F(WriteReport, TheSameResultGivesTheSameBytes) {
  const study::IdentifyResult result = identify_result(MechanismKind::flywheel);
  ASSERT_TRUE(write(result, folder("a"), {.command = "flyball", .files = {}}));
  ASSERT_TRUE(write(result, folder("b"), {.command = "flyball", .files = {}}));
  EXPECT_EQ(files_in(folder("a")), files_in(folder("b")));
  for (const std::string& name : files_in(folder("a"))) {
    EXPECT_EQ(text_of(folder("a") + "/" + name), text_of(folder("b") + "/" + name)) << name;
  }
}

TEST_F(WriteReport, ARefusedLogIsWrittenToo) {
  ASSERT_TRUE(write(refused_result(), folder()));
  const std::set<std::string> files = files_in(folder());
  EXPECT_EQ(files.count("pictures/recorded_1_quasistatic-forward.png"), 1u);
  EXPECT_EQ(files.count("gains.toml"), 0u);
  const auto json = nlohmann::json::parse(text_of(folder() + "/result.json"));
  EXPECT_TRUE(json.contains("error"));
}

// One bound for all pictures together, and the report without them.
TEST_F(WriteReport, AGnuplotThatHangsCostsThePicturesAndABoundedTime) {
  fs::create_directories(folder("bin"));
  const std::string fake = folder("bin") + "/gnuplot";
  std::ofstream(fake) << "#!/bin/sh\nexec /bin/sleep 100\n";
  fs::permissions(fake, fs::perms::owner_all);
  const std::string before = ::getenv("PATH");
  ::setenv("PATH", folder("bin").c_str(), 1);
  const Answer answer = study::answer_of(design_result(MechanismKind::arm));
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Picture> pictures = draw(answer.figures, true, 0.5);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  std::ofstream(fake, std::ios::trunc) << "#!/bin/sh\nexit 3\n";
  const auto written = write_report(answer, folder());
  ::setenv("PATH", before.c_str(), 1);
  ASSERT_GT(pictures.size(), 2U);
  for (const Picture& picture : pictures) {
    EXPECT_TRUE(picture.svg.empty() && picture.png.empty());
    EXPECT_NE(picture.problem.find("did not finish"), std::string::npos) << picture.problem;
  }
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(written->problems.size(), pictures.size());
  EXPECT_EQ(files_in(folder()).count("index.html"), 1u);
  EXPECT_EQ(files_in(folder()).count("pictures/poles.svg"), 0u);
  // The page says so once on top, and still has its data, tables and interactive plots.
  const std::string page = text_of(folder() + "/index.html");
  const std::size_t said = page.find(" still pictures could not be drawn: ");
  ASSERT_NE(said, std::string::npos);
  EXPECT_LT(said, page.find("<main>"));
  EXPECT_NE(page.find("data-name=\"poles\""), std::string::npos);
  EXPECT_NE(page.find("\"title\":\"Poles in the z plane\""), std::string::npos);
  EXPECT_EQ(page.find("<svg"), page.find("<svg", page.find("<script>"))) << "in scripts alone";
}

TEST_F(WriteReport, AnEarlierReportIsReplacedAndNothingElse) {
  ASSERT_TRUE(write(design_result(MechanismKind::arm), folder()));
  ASSERT_TRUE(write(design_result(MechanismKind::elevator), folder()));
  EXPECT_EQ(files_in(folder()).count("ElevatorLoop.hpp"), 1u);
  EXPECT_EQ(files_in(folder()).count("ArmLoop.hpp"), 0u);

  fs::create_directories(folder("mine"));
  std::ofstream(folder("mine") + "/thesis.txt") << "years of work";
  const auto refused = write(design_result(MechanismKind::arm), folder("mine"));
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(FileError::folder_in_use));
  EXPECT_EQ(files_in(folder("mine")), (std::set<std::string>{"thesis.txt"}));
}

}  // namespace
}  // namespace flyball::report::write_report_test
