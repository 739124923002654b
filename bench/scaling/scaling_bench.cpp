// How time and memory of a whole dare() and care() grow with the number of states:
// `bench_scaling [PICTURE.svg]`. m = n/2, random plants of spectral radius 1.05; the time is the
// smallest of a few, the memory what a process of its own needs more at its peak than one that only
// makes the data.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <vector>

#include <Eigen/Core>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <flyball/core/random.hpp>
#include <flyball/io/plot.hpp>
#include <flyball/math/riccati/riccati.hpp>

namespace {

using Eigen::MatrixXd;
using Clock = std::chrono::steady_clock;

struct Equation {
  MatrixXd A, B, Q, R;
};

Equation random_equation(int n) {
  flyball::Random random(static_cast<std::uint64_t>(n));
  const auto normal = [&random](int rows, int columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&random] { return random.normal(); }));
  };
  const int m = n / 2;
  Equation e{normal(n, n), normal(n, m), MatrixXd::Identity(n, n), MatrixXd::Identity(m, m)};
  // The circular law: the spectral radius of normal entries is about √n.
  e.A *= 1.05 / std::sqrt(static_cast<double>(n));
  return e;
}

bool solve(const Equation& e, bool continuous) {
  return (continuous ? flyball::care(e.A, e.B, e.Q, e.R) : flyball::dare(e.A, e.B, e.Q, e.R))
      .has_value();
}

double milliseconds(const Equation& e, bool continuous) {
  double best = 1e300;
  const int repetitions = e.A.rows() <= 100 ? 20 : 5;
  for (int k = 0; k < repetitions; ++k) {
    const auto start = Clock::now();
    if (!solve(e, continuous)) {
      return std::nan("");
    }
    best = std::min(best, std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  }
  return best;
}

/// Peak resident size of a child that makes the equation, and solves it if asked to, in MB.
double peak_megabytes(int n, bool solving, bool continuous) {
  const pid_t child = fork();
  if (child == 0) {
    const Equation e = random_equation(n);
    _exit(solving && !solve(e, continuous) ? 1 : 0);
  }
  rusage usage{};
  int status = 0;
  wait4(child, &status, 0, &usage);
  return status == 0 ? static_cast<double>(usage.ru_maxrss) / 1024.0 : std::nan("");
}

struct Curve {
  std::vector<double> n, time, memory_n, memory;
};

/// Before any time is taken: what this process has freed, its children find again.
void measure_memory(bool continuous, Curve& curve) {
  for (const int n : {100, 150, 200, 300, 400}) {
    const double memory =
        peak_megabytes(n, true, continuous) - peak_megabytes(n, false, continuous);
    curve.memory_n.push_back(n);
    curve.memory.push_back(memory);
    std::printf("%s %5d %12.1f MB %8.1f n^2 doubles\n", continuous ? "care" : "dare", n, memory,
                memory * 131072.0 / std::pow(n, 2));
  }
}

void measure_time(bool continuous, Curve& curve) {
  for (const int n : {10, 20, 40, 60, 100, 150, 200, 300, 400}) {
    const double time = milliseconds(random_equation(n), continuous);
    curve.n.push_back(n);
    curve.time.push_back(time);
    std::printf("%s %5d %12.3f ms %8.2f n^3 ns\n", continuous ? "care" : "dare", n, time,
                time * 1e6 / std::pow(n, 3));
  }
}

/// A power of n through the last point.
flyball::PlotLine guide(const char* label, const std::vector<double>& n,
                        const std::vector<double>& values, int power) {
  flyball::PlotLine line{.label = label, .style = flyball::LineStyle::dotted, .color = 6};
  for (const double size : n) {
    line.x.push_back(size);
    line.y.push_back(values.back() * std::pow(size / n.back(), power));
  }
  return line;
}

}  // namespace

int main(int argc, char** argv) {
  Curve dare;
  Curve care;
  measure_memory(false, dare);
  measure_memory(true, care);
  measure_time(false, dare);
  measure_time(true, care);
  if (argc < 2) {
    return 0;
  }
  using flyball::LineStyle;
  flyball::PlotPanel time{.y_label = "Time (ms)", .log_y = true};
  time.lines = {{"dare", dare.n, dare.time, LineStyle::samples, 0},
                {"care", care.n, care.time, LineStyle::circles, 1},
                guide("n³", dare.n, dare.time, 3)};
  flyball::PlotPanel memory{.y_label = "Memory (MB)", .log_y = true};
  memory.lines = {{"dare", dare.memory_n, dare.memory, LineStyle::samples, 0},
                  {"care", care.memory_n, care.memory, LineStyle::circles, 1},
                  guide("n²", dare.memory_n, dare.memory, 2)};
  const auto svg = flyball::render_svg({.title = "Whole Riccati solves, m = n/2, one thread",
                                        .x_label = "Number of states n",
                                        .panels = {time, memory},
                                        .log_x = true});
  if (!svg) {
    std::fprintf(stderr, "%s\n", to_string(svg.error()).c_str());
    return 1;
  }
  std::ofstream(argv[1]) << *svg << '\n';
  return 0;
}
