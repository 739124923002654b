// How long lyapunov(), discrete_lyapunov(), sylvester() and discrete_sylvester() take, checks,
// refinement and condition estimate included, beside SLICOT's SB03MD, SB04MD and SB04QD, which give
// X alone, on the same data in the same process, one thread: `bench_matrix_equation [repetitions]`.
// Minima per equation over repetitions that alternate between the two.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <Eigen/Dense>

#include <flyball/core/random.hpp>
#include <flyball/math/equations/matrix_equation.hpp>

#include "timing.hpp"

extern "C" {
void sb03md_(const char* dico, const char* job, const char* fact, const char* trana, const int* n,
             double* A, const int* lda, double* U, const int* ldu, double* C, const int* ldc,
             double* scale, double* sep, double* ferr, double* wr, double* wi, int* iwork,
             double* dwork, const int* ldwork, int* info);
void sb04md_(const int* n, const int* m, double* A, const int* lda, double* B, const int* ldb,
             double* C, const int* ldc, double* Z, const int* ldz, int* iwork, double* dwork,
             const int* ldwork, int* info);
void sb04qd_(const int* n, const int* m, double* A, const int* lda, double* B, const int* ldb,
             double* C, const int* ldc, double* Z, const int* ldz, int* iwork, double* dwork,
             const int* ldwork, int* info);
void openblas_set_num_threads(int threads);
}

namespace {

using bench::microseconds;
using Eigen::MatrixXd;
using Eigen::VectorXd;

enum class Kind {
  lyapunov,
  discrete_lyapunov,
  sylvester,
  unstable_lyapunov,
  unstable_discrete_lyapunov,
  mixed_sylvester,
  discrete_sylvester
};

bool is_sylvester(Kind kind) {
  return kind == Kind::sylvester || kind == Kind::mixed_sylvester ||
         kind == Kind::discrete_sylvester;
}

struct Equation {
  MatrixXd A, B, C;
};

/// Stable A and B with eigenvalues well away from the boundary, or eigenvalues on both sides of it.
Equation random_equation(flyball::Random& random, int n, Kind kind) {
  const auto normal = [&random, n] {
    return MatrixXd(MatrixXd::NullaryExpr(n, n, [&random] { return random.normal(); }));
  };
  Equation e{normal(), normal(), normal()};
  if (kind == Kind::discrete_lyapunov) {
    e.A *= 0.9 / e.A.eigenvalues().cwiseAbs().maxCoeff();
  } else if (kind == Kind::lyapunov || kind == Kind::sylvester) {
    e.A.diagonal().array() -= e.A.eigenvalues().real().maxCoeff() + 0.5;
    e.B.diagonal().array() -= e.B.eigenvalues().real().maxCoeff() + 0.5;
  }
  if (!is_sylvester(kind)) {
    e.C = e.C.transpose() * e.C;
  }
  return e;
}

/// With the workspace allocated once; the data is overwritten, so it is copied each time.
class Slicot {
 public:
  explicit Slicot(int n)
      : n_(n),
        U_(n, n),
        real_(n),
        imaginary_(n),
        work_(16 * n * n + 64 * n),
        integers_(static_cast<std::size_t>(std::max(n * n, 4 * n))) {}

  /// X of AX + XAᵀ = C or AXAᵀ - X = C, or of AX + XB = C or X - AXB = C.
  const MatrixXd& solve(const Equation& e, Kind kind) {
    A_ = e.A;
    X_ = e.C;
    const int ldwork = static_cast<int>(work_.size());
    int info = 0;
    if (is_sylvester(kind)) {
      B_ = e.B;
      if (kind == Kind::discrete_sylvester) {
        A_ = -e.A;
      }
      (kind == Kind::discrete_sylvester ? sb04qd_ : sb04md_)(
          &n_, &n_, A_.data(), &n_, B_.data(), &n_, X_.data(), &n_, U_.data(), &n_,
          integers_.data(), work_.data(), &ldwork, &info);
    } else {
      double scale = 0.0;
      double sep = 0.0;
      double error = 0.0;
      sb03md_(kind == Kind::lyapunov || kind == Kind::unstable_lyapunov ? "C" : "D", "X", "N", "T",
              &n_, A_.data(), &n_, U_.data(), &n_, X_.data(), &n_, &scale, &sep, &error,
              real_.data(), imaginary_.data(), integers_.data(), work_.data(), &ldwork, &info);
    }
    if (info != 0) {
      X_.setConstant(0.0);
    }
    return X_;
  }

 private:
  int n_;
  MatrixXd A_, B_, X_, U_;
  VectorXd real_, imaginary_, work_;
  std::vector<int> integers_;
};

flyball::Expected<flyball::LinearMatrixSolution> solve_ours(const Equation& e, Kind kind) {
  switch (kind) {
    case Kind::lyapunov:
    case Kind::unstable_lyapunov:
      return flyball::lyapunov(e.A, e.C);
    case Kind::discrete_lyapunov:
    case Kind::unstable_discrete_lyapunov:
      return flyball::discrete_lyapunov(e.A, e.C);
    case Kind::discrete_sylvester:
      return flyball::discrete_sylvester(e.A, e.B, e.C);
    case Kind::sylvester:
    case Kind::mixed_sylvester:
      break;
  }
  return flyball::sylvester(e.A, e.B, e.C);
}

void compare(Kind kind, int n, int repetitions) {
  flyball::Random random(static_cast<std::uint64_t>(n));
  Slicot slicot(n);
  const double sign = is_sylvester(kind) ? 1.0 : -1.0;
  const int calls = std::max(1, 2000 / (n * n * n + 50));
  constexpr int count = 6;
  double time_ours = 0.0;
  double time_slicot = 0.0;
  double difference = 0.0;
  double sink = 0.0;
  for (int k = 0; k < count; ++k) {
    const Equation e = random_equation(random, n, kind);
    const auto ours = solve_ours(e, kind);
    if (!ours) {
      std::printf("n = %d: not solved\n", n);
      return;
    }
    difference =
        std::max(difference, (ours->X - sign * slicot.solve(e, kind)).norm() / ours->X.norm());
    double best_ours = 1e300;
    double best_slicot = 1e300;
    for (int r = 0; r < repetitions; ++r) {
      best_ours =
          std::min(best_ours, microseconds(calls, [&] { sink += solve_ours(e, kind)->X(0, 0); }));
      best_slicot =
          std::min(best_slicot, microseconds(calls, [&] { sink += slicot.solve(e, kind)(0, 0); }));
    }
    time_ours += best_ours;
    time_slicot += best_slicot;
  }
  std::printf("%5d %12.2f %12.2f %9.2f %14.1e%s\n", n, time_ours / count, time_slicot / count,
              time_slicot / time_ours, difference, sink == 0.5 ? " " : "");
}

}  // namespace

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 30;
  std::printf("minima in microseconds, one thread\n");
  for (const auto& [kind, title] :
       {std::pair{Kind::lyapunov, "lyapunov, SB03MD"},
        std::pair{Kind::discrete_lyapunov, "discrete_lyapunov, SB03MD"},
        std::pair{Kind::sylvester, "sylvester, SB04MD"},
        std::pair{Kind::unstable_lyapunov, "lyapunov, any A, SB03MD"},
        std::pair{Kind::unstable_discrete_lyapunov, "discrete_lyapunov, any A, SB03MD"},
        std::pair{Kind::mixed_sylvester, "sylvester, any A, B, SB04MD"},
        std::pair{Kind::discrete_sylvester, "discrete_sylvester, any A, B, SB04QD"}}) {
    std::printf("%s\n%5s %12s %12s %9s %14s\n", title, "n", "flyball", "SLICOT", "ratio",
                "difference");
    for (const int n : {2, 5, 10, 20, 50, 100}) {
      compare(kind, n, n < 50 ? repetitions : std::max(3, repetitions / 5));
    }
  }
  return 0;
}
