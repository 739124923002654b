// How long a whole dare() or care() takes, checks and eigenvalues included, beside SLICOT's SB02OD
// on the same data in the same process, one thread: `bench_riccati [repetitions]`. Minima over
// repetitions that alternate between the two, because another process may hold the machine in any
// of them.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/system.hpp>

#include "timing.hpp"

extern "C" {
void sb02od_(const char* dico, const char* jobb, const char* fact, const char* uplo,
             const char* jobl, const char* sort, const int* n, const int* m, const int* p,
             const double* A, const int* lda, const double* B, const int* ldb, const double* Q,
             const int* ldq, const double* R, const int* ldr, const double* L, const int* ldl,
             double* rcond, double* X, const int* ldx, double* alfar, double* alfai, double* beta,
             double* S, const int* lds, double* T, const int* ldt, double* U, const int* ldu,
             const double* tol, int* iwork, double* dwork, const int* ldwork, int* bwork,
             int* info);
void openblas_set_num_threads(int threads);
}

namespace {

using bench::microseconds;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Equation {
  MatrixXd A, B, Q, R;
};

/// Ordinary data: A random with spectral radius 1.05; every other equation has Q = CᵀC, the others
/// Q = I; R = I.
Equation random_equation(flyball::Random& random, int n, int m, bool identity) {
  const auto normal = [&random](int rows, int columns) {
    MatrixXd M(rows, columns);
    for (double& entry : M.reshaped()) {
      entry = random.normal();
    }
    return M;
  };
  Equation e{normal(n, n), normal(n, m), MatrixXd::Identity(n, n), MatrixXd::Identity(m, m)};
  e.A *= 1.05 / flyball::poles(e.A)->cwiseAbs().maxCoeff();
  if (!identity) {
    const MatrixXd C = normal(std::max(1, n / 2), n);
    e.Q = C.transpose() * C;
  }
  return e;
}

/// SB02OD with its workspace allocated once, which is the peer's best case.
class Slicot {
 public:
  Slicot(int n, int m)
      : n_(n),
        m_(m),
        size_(2 * n + m),
        X_(n, n),
        alpha_real_(2 * n),
        alpha_imaginary_(2 * n),
        beta_(2 * n),
        S_(size_, size_),
        T_(size_, 2 * n),
        U_(2 * n, 2 * n),
        integers_(static_cast<std::size_t>(std::max(m, 2 * n))),
        flags_(static_cast<std::size_t>(2 * n)),
        work_(std::max({7 * (2 * n + 1) + 16, 16 * n, 2 * n + m, 3 * m, 64 * size_})) {}

  int solve(const Equation& e, const char* domain = "D") {
    const int p = 0;
    const int one = 1;
    const int twice = 2 * n_;
    const int ldwork = static_cast<int>(work_.size());
    const double tolerance = 0.0;
    const double none = 0.0;
    double rcond = 0.0;
    int info = 0;
    sb02od_(domain, "B", "N", "U", "Z", "S", &n_, &m_, &p, e.A.data(), &n_, e.B.data(), &n_,
            e.Q.data(), &n_, e.R.data(), &m_, &none, &one, &rcond, X_.data(), &n_,
            alpha_real_.data(), alpha_imaginary_.data(), beta_.data(), S_.data(), &size_, T_.data(),
            &size_, U_.data(), &twice, &tolerance, integers_.data(), work_.data(), &ldwork,
            flags_.data(), &info);
    return info;
  }
  [[nodiscard]] const MatrixXd& X() const { return X_; }

 private:
  int n_, m_, size_;
  MatrixXd X_;
  VectorXd alpha_real_, alpha_imaginary_, beta_;
  MatrixXd S_, T_, U_;
  std::vector<int> integers_, flags_;
  VectorXd work_;
};

/// Two states whose closed loop keeps a pole about `margin` inside the boundary: one mode of A lies
/// on it and is weighed by `margin`², or lies `margin` outside and is not weighed at all.
Equation near_margin(flyball::Random& random, bool continuous, double margin, bool weighed) {
  Equation e = random_equation(random, 2, 1, true);
  const double outside = weighed ? 0.0 : margin;
  if (continuous) {
    e.A.diagonal().array() -= flyball::poles(e.A)->real().maxCoeff() - outside;
  } else {
    e.A *= (1.0 + outside) / flyball::poles(e.A)->cwiseAbs().maxCoeff();
  }
  const MatrixXd C = MatrixXd::NullaryExpr(1, 2, [&random] { return random.normal(); });
  e.Q = weighed ? MatrixXd(margin * margin * C.transpose() * C) : MatrixXd(MatrixXd::Zero(2, 2));
  return e;
}

/// One of the two equations on the same data: the time of a set is the sum of its members' minima.
void compare(bool continuous, const std::vector<Equation>& equations, int repetitions) {
  const char* const domain = continuous ? "C" : "D";
  const auto solve_ours = [continuous](const Equation& e) {
    return continuous ? flyball::care(e.A, e.B, e.Q, e.R) : flyball::dare(e.A, e.B, e.Q, e.R);
  };
  const int n = static_cast<int>(equations.front().A.rows());
  const int m = static_cast<int>(equations.front().B.cols());
  Slicot slicot(n, m);
  const int calls = std::max(1, 4000 / (n * n * n + 20));
  double largest_difference = 0.0;
  double time_ours = 0.0;
  double time_slicot = 0.0;
  double worst_ratio = 1e300;
  int refused = 0;
  int solved = 0;
  double sink = 0.0;
  for (const Equation& e : equations) {
    const auto ours = solve_ours(e);
    if (!ours) {
      std::printf("n = %d: not solved\n", n);
      return;
    }
    if (slicot.solve(e, domain) != 0) {
      ++refused;
      continue;
    }
    ++solved;
    largest_difference =
        std::max(largest_difference, (ours->X - slicot.X()).norm() / ours->X.norm());
    double best_ours = 1e300;
    double best_slicot = 1e300;
    for (int r = 0; r < repetitions; ++r) {
      best_ours = std::min(best_ours, microseconds(calls, [&] { sink += solve_ours(e)->X(0, 0); }));
      best_slicot =
          std::min(best_slicot, microseconds(calls, [&] { sink += slicot.solve(e, domain); }));
    }
    time_ours += best_ours;
    time_slicot += best_slicot;
    worst_ratio = std::min(worst_ratio, best_slicot / best_ours);
  }
  std::printf("%5d %5d %12.2f %12.2f %9.2f %9.2f %14.1e", n, m, time_ours / solved,
              time_slicot / solved, time_slicot / time_ours, worst_ratio, largest_difference);
  std::printf(refused > 0 ? "   %d not solved by SB02OD" : "", refused);
  std::printf("%s\n", sink == 0.5 ? " " : "");
}

template <int States, int Inputs>
void absolute(const char* name, const Equation& e, const char* wpimath, int repetitions) {
  const Eigen::Matrix<double, States, States> A = e.A;
  const Eigen::Matrix<double, States, Inputs> B = e.B;
  const Eigen::Matrix<double, States, States> Q = e.Q;
  const Eigen::Matrix<double, Inputs, Inputs> R = e.R;
  double fixed = 1e300;
  double dynamic = 1e300;
  double sink = 0.0;
  for (int r = 0; r < 20 * repetitions; ++r) {
    fixed = std::min(fixed, microseconds(100, [&] { sink += flyball::dare(A, B, Q, R)->X(0, 0); }));
    dynamic = std::min(
        dynamic, microseconds(100, [&] { sink += flyball::dare(e.A, e.B, e.Q, e.R)->X(0, 0); }));
  }
  const auto solution = flyball::dare(e.A, e.B, e.Q, e.R).value();
  std::printf("%-28s %8.2f %8.2f   %-12s tr X = %.9g, condition %.1e, %d iterations%s\n", name,
              fixed, dynamic, wpimath, solution.X.trace(), solution.condition, solution.iterations,
              sink == 0.5 ? " " : "");
}

/// x₊ of a double integrator with viscous friction, sampled by its exact exponential.
Equation elevator(double period) {
  const double kv = 4.0;
  const double ka = 0.3;
  const double a = -kv / ka;
  const double decay = std::exp(a * period);
  Equation e{MatrixXd(2, 2), MatrixXd(2, 1), MatrixXd::Zero(2, 2), MatrixXd(1, 1)};
  e.A << 1, (decay - 1) / a, 0, decay;
  e.B << ((decay - 1) / a - period) / a / ka, (decay - 1) / a / ka;
  e.Q.diagonal() << 1 / (0.02 * 0.02), 1 / (0.4 * 0.4);
  e.R << 1 / (12.0 * 12.0);
  return e;
}

/// The pose and wheel velocities of a differential drive at 1 m/s, sampled to second order.
Equation differential_drive(double period) {
  MatrixXd A = MatrixXd::Zero(5, 5);
  A(0, 3) = A(0, 4) = 0.5;
  A(1, 2) = 1.0;
  A(2, 3) = -1.0 / 0.6;
  A(2, 4) = 1.0 / 0.6;
  A(3, 3) = A(4, 4) = -6.0;
  A(3, 4) = A(4, 3) = 1.5;
  MatrixXd B = MatrixXd::Zero(5, 2);
  B(3, 0) = B(4, 1) = 2.8;
  B(3, 1) = B(4, 0) = -0.7;
  const MatrixXd I = MatrixXd::Identity(5, 5);
  Equation e{I + A * period + A * A * (0.5 * period * period),
             (I * period + A * (0.5 * period * period)) * B, MatrixXd::Zero(5, 5),
             MatrixXd::Identity(2, 2) / (12.0 * 12.0)};
  e.Q.diagonal() << 1 / (0.0625 * 0.0625), 1 / (0.125 * 0.125), 1 / 6.25, 1 / (0.95 * 0.95),
      1 / (0.95 * 0.95);
  return e;
}

}  // namespace

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 50;
  std::printf("whole solves, minima in microseconds, one thread\n");
  for (const bool continuous : {false, true}) {
    const auto heading = [continuous](const char* data) {
      std::printf("%s, %s\n%5s %5s %12s %12s %9s %9s %14s\n", continuous ? "care" : "dare", data,
                  "n", "m", "flyball", "SB02OD", "ratio", "least", "difference");
    };
    heading("ordinary data");
    for (const int n : {2, 5, 10, 20, 50, 100}) {
      flyball::Random random(static_cast<std::uint64_t>(n));
      std::vector<Equation> equations;
      for (int k = 0; k < 8; ++k) {
        equations.push_back(random_equation(random, n, std::max(1, n / 2), k % 2 == 0));
      }
      compare(continuous, equations, repetitions);
    }
    heading("near the margin of stability, 1e-1 to 1e-8");
    for (const double margin : {1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8}) {
      flyball::Random random(7);
      std::vector<Equation> equations;
      for (int k = 0; k < 16; ++k) {
        equations.push_back(near_margin(random, continuous, margin, k % 2 == 0));
      }
      compare(continuous, equations, repetitions);
    }
  }
  std::printf("\n%-28s %8s %8s   %s\n", "", "fixed", "dynamic", "wpimath, measured elsewhere");
  absolute<2, 1>("elevator 2x1, 5 ms", elevator(0.005), "4.1-4.4", repetitions);
  absolute<5, 2>("differential drive 5x2, 5 ms", differential_drive(0.005), "22-28", repetitions);
  flyball::Random random(1);
  absolute<10, 3>("random 10x3", random_equation(random, 10, 3, true), "99-166", repetitions);
  return 0;
}
