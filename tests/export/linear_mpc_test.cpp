// Predictive controllers' headers, compiled and run against the library's objects.
#include <flyball/export/linear_mpc.hpp>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "control/mpc/mpc_problems.hpp"

namespace linear_mpc_test {
namespace {

using namespace flyball;
using Eigen::VectorXd;
using mpc_problems::Program;
namespace fs = std::filesystem;

constexpr int periods = 25;

/// The loop of a program: its inputs and statuses, by a driver that was compiled with the header.
std::string run(const Program& p, const std::string& header) {
  const fs::path folder =
      fs::path(testing::TempDir()) / ("linear_mpc_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "controller.hpp") << header;
  std::ofstream main(folder / "main.cpp");
  const auto list = [](const VectorXd& v) {
    std::string text;
    for (const double value : v) {
      char number[64];
      std::snprintf(number, sizeof number, "%a, ", value);
      text += number;
    }
    return text;
  };
  main << R"(#include "controller.hpp"
#include <cstdio>
int main() {
  static mpc::Controller made;
  double x[mpc::states] = {)"
       << list(p.x_0) << "};\n  double r[mpc::states] = {" << list(p.r)
       << "};\n  double d[mpc::states] = {" << list(p.d) << "};\n  double u_r[mpc::inputs] = {"
       << list(p.u_r) << "};\n  double last[mpc::inputs] = {" << list(p.u_last) << R"(};
  made.set_reference(r, u_r);
  made.set_disturbance(d);
  made.set_last_input(last);
  static mpc::Controller controller = made;  // a copy has its own memory
  static_assert(noexcept(controller.calculate(x, u_r)), "");
  for (int k = 0; k < )"
       << periods << R"(; ++k) {
    double u[mpc::inputs] = {};
    controller.calculate(x, u);
    std::printf("%d", static_cast<int>(controller.status()));
    double next[mpc::states];
    for (int i = 0; i < mpc::states; ++i) {
      next[i] = d[i];
      for (int j = 0; j < mpc::states; ++j) {
        next[i] += mpc::A[i][j] * x[j];
      }
      for (int j = 0; j < mpc::inputs; ++j) {
        next[i] += mpc::B[i][j] * u[j];
      }
    }
    for (int j = 0; j < mpc::inputs; ++j) {
      std::printf(" %.17g", u[j]);
    }
    std::printf("\n");
    for (int i = 0; i < mpc::states; ++i) {
      x[i] = next[i];
    }
  }
}
)";
  main.close();
  const std::string line = "cd '" + folder.string() + "' && (" + FLYBALL_CXX +
                           " -std=c++17 -O1 -ffp-contract=off -fno-exceptions -Wall -Wextra "
                           "-Wpedantic -Wconversion -Wshadow -Werror main.cpp -o main && "
                           "./main > out) > log 2>&1";
  if (std::system(line.c_str()) != 0) {
    std::ifstream log(folder / "log");
    ADD_FAILURE() << std::string(std::istreambuf_iterator<char>(log), {});
  }
  std::ifstream out(folder / "out");
  std::string answer(std::istreambuf_iterator<char>(out), {});
  fs::remove_all(folder);
  return answer;
}

void expect_same_loop(const Program& p) {
  auto mpc = mpc_problems::controller(p).value();
  std::istringstream out(run(p, exports::linear_mpc_header(mpc, "a test")));
  VectorXd x = p.x_0;
  for (int k = 0; k < periods; ++k) {
    const VectorXd u = mpc.calculate(x);
    int status = -1;
    VectorXd generated(u.size());
    out >> status;
    for (double& value : generated) {
      out >> value;
    }
    ASSERT_TRUE(out) << k;
    EXPECT_EQ(status, static_cast<int>(mpc.status())) << k;
    // Each in its own loop, and limits of states to 1e-8 of the interior-point method.
    EXPECT_LT((generated - u).norm(), 1e-4 * (1.0 + u.norm())) << k;
    x = p.A * x + p.B * u + p.d;
  }
}

TEST(LinearMpcHeader, OfADriveWithLimitsOfInputs) {
  expect_same_loop(mpc_problems::drive());
}

TEST(LinearMpcHeader, WithRatesAndLimitsOfStates) {
  Program p = mpc_problems::drive();
  p.settings.horizon = 12;
  p.settings.du_max = VectorXd::Constant(2, 2.0);
  p.settings.x_max = VectorXd{{HUGE_VAL, HUGE_VAL, HUGE_VAL, 0.3, 0.3}};
  p.r(0) = 1.0;
  p.d(1) = 0.01;
  expect_same_loop(p);
}

TEST(LinearMpcHeader, SaysWhatItIs) {
  const auto mpc = mpc_problems::controller(mpc_problems::drive()).value();
  const std::string header = exports::linear_mpc_header(mpc, "a drive\n#error");
  EXPECT_NE(
      header.find("// A linear model predictive controller over 20 periods: 5 states, 2 inputs."),
      std::string::npos);
  EXPECT_EQ(header.find("\n#error"), std::string::npos);
  EXPECT_EQ(header.find("Eigen"), std::string::npos);
  EXPECT_NE(header.find("inline constexpr double u_max[inputs] = {12.0, 12.0};"),
            std::string::npos);
}

}  // namespace
}  // namespace linear_mpc_test
