// How time and memory of a whole dare() and care() grow with the number of states, and the time of
// the other kernels: `bench_scaling [RICCATI.svg [KERNELS.svg]]`. m = n/2, random plants of
// spectral radius 1.05; the time is the smallest of a few of the processor's, the memory what a
// process of its own needs more at its peak than one that only makes the data. Beside each time of
// a kernel stands its share of the power of n that is fitted to all from 40 states on: a cliff is
// one above 1.5.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <flyball/control/pole_placement.hpp>
#include <flyball/core/random.hpp>
#include <flyball/io/plot.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/analysis.hpp>

namespace {

using Eigen::MatrixXd;

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

/// The smallest processor time of some calls; not a number where one is refused.
double milliseconds(int repetitions, const std::function<bool()>& work) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
  };
  double best = 1e300;
  double spent = 0.0;
  for (int k = 0; k < repetitions && spent < 3e3; ++k) {
    const double start = now();
    if (!work()) {
      return std::nan("");
    }
    best = std::min(best, now() - start);
    spent += now() - start;
  }
  return best;
}

double milliseconds(const Equation& e, bool continuous) {
  return milliseconds(e.A.rows() <= 100 ? 20 : 5, [&] { return solve(e, continuous); });
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

struct Kernel {
  const char* name;
  int largest;  ///< Number of states.
  std::function<bool(const Equation&)> work;
};

/// Lightly damped masses in a row between two walls: what a power series has many terms of.
MatrixXd chain(Eigen::Index n) {
  const Eigen::Index masses = n / 2;
  MatrixXd K = MatrixXd::Zero(masses, masses);
  K.diagonal().setConstant(-2.0);
  K.diagonal(1).setOnes();
  K.diagonal(-1).setOnes();
  MatrixXd A = MatrixXd::Zero(n, n);
  A.topRightCorner(masses, masses).setIdentity();
  A.bottomLeftCorner(masses, masses) = K;
  A.bottomRightCorner(masses, masses) = 0.01 * K;
  return A;
}

std::vector<Kernel> kernels() {
  // A of the equations has a spectral radius of 1.05: with 0.8 of it one is stable in steps, and
  // with 2 taken from its diagonal in time.
  const auto stable = [](const Equation& e) -> MatrixXd {
    return e.A - 2.0 * MatrixXd::Identity(e.A.rows(), e.A.rows());
  };
  return {
      {"lyapunov", 400,
       [=](const Equation& e) { return flyball::lyapunov(stable(e), e.Q).has_value(); }},
      {"lyapunov, chain", 400,
       [](const Equation& e) { return flyball::lyapunov(chain(e.A.rows()), e.Q).has_value(); }},
      {"discrete_lyapunov", 400,
       [](const Equation& e) { return flyball::discrete_lyapunov(0.8 * e.A, e.Q).has_value(); }},
      {"expm", 400, [](const Equation& e) { return flyball::expm(3.0 * e.A).has_value(); }},
      {"logm", 400,
       [](const Equation& e) {
         return flyball::logm(3.0 * MatrixXd::Identity(e.A.rows(), e.A.rows()) + e.A).has_value();
       }},
      {"analyze_modes", 400,
       [=](const Equation& e) {
         return flyball::analyze_modes(stable(e), flyball::TimeDomain::continuous).has_value();
       }},
      {"place", 200,
       [](const Equation& e) {
         const Eigen::VectorXcd poles =
             Eigen::VectorXd::LinSpaced(e.A.rows(), -1.0, -5.0).cast<std::complex<double>>();
         return flyball::place(e.A, e.B, poles).has_value();
       }},
  };
}

/// A kernel's times, each beside the power of n that is fitted to those from 40 states on.
Curve measure(const Kernel& kernel) {
  Curve curve;
  for (const int n : {10, 20, 40, 60, 100, 150, 200, 300, 400}) {
    if (n <= kernel.largest) {
      const Equation e = random_equation(n);
      curve.n.push_back(n);
      curve.time.push_back(milliseconds(n <= 100 ? 20 : 3, [&] { return kernel.work(e); }));
    }
  }
  double count = 0.0;
  double x = 0.0;
  double y = 0.0;
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t k = 0; k < curve.n.size(); ++k) {
    if (curve.n[k] >= 40.0) {
      const double a = std::log(curve.n[k]);
      const double b = std::log(curve.time[k]);
      count += 1.0;
      x += a;
      y += b;
      xx += a * a;
      xy += a * b;
    }
  }
  const double slope = (count * xy - x * y) / (count * xx - x * x);
  const double height = (y - slope * x) / count;
  for (std::size_t k = 0; k < curve.n.size(); ++k) {
    std::printf("%s %5.0f %12.3f ms %8.2f of n^%.2f\n", kernel.name, curve.n[k], curve.time[k],
                curve.time[k] / std::exp(height + slope * std::log(curve.n[k])), slope);
    std::fflush(stdout);
  }
  return curve;
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
  if (argc < 3) {
    return 0;
  }
  flyball::PlotPanel panel{.y_label = "Time (ms)", .log_y = true};
  int color = 0;
  for (const Kernel& kernel : kernels()) {
    const Curve curve = measure(kernel);
    panel.lines.push_back({kernel.name, curve.n, curve.time, LineStyle::solid, color++});
    if (color == 1) {
      panel.lines.push_back(guide("n³", curve.n, curve.time, 3));
    }
  }
  const auto picture = flyball::render_svg({.title = "Whole calls, one thread",
                                            .x_label = "Number of states n",
                                            .panels = {panel},
                                            .log_x = true});
  if (!picture) {
    std::fprintf(stderr, "%s\n", to_string(picture.error()).c_str());
    return 1;
  }
  std::ofstream(argv[2]) << *picture << '\n';
  return 0;
}
