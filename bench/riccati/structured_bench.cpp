// How long dare(), care() and the Lyapunov equations take on data with structure, beside SLICOT's
// SB02OD, SB02MD and SB03MD on the same data in the same process, one thread:
// `bench_structured [repetitions] [largest n] [part of a table's heading]`. Minima of processor
// time over repetitions that alternate.
//
// SB02MD takes G = B R⁻¹ Bᵀ, which is formed for it outside of what is timed.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include <flyball/core/random.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/system.hpp>

extern "C" {
void sb02od_(const char* dico, const char* jobb, const char* fact, const char* uplo,
             const char* jobl, const char* sort, const int* n, const int* m, const int* p,
             const double* A, const int* lda, const double* B, const int* ldb, const double* Q,
             const int* ldq, const double* R, const int* ldr, const double* L, const int* ldl,
             double* rcond, double* X, const int* ldx, double* alfar, double* alfai, double* beta,
             double* S, const int* lds, double* T, const int* ldt, double* U, const int* ldu,
             const double* tol, int* iwork, double* dwork, const int* ldwork, int* bwork,
             int* info);
void sb02md_(const char* dico, const char* hinv, const char* uplo, const char* scal,
             const char* sort, const int* n, double* A, const int* lda, const double* G,
             const int* ldg, double* Q, const int* ldq, double* rcond, double* wr, double* wi,
             double* S, const int* lds, double* U, const int* ldu, int* iwork, double* dwork,
             const int* ldwork, int* bwork, int* info);
void sb03md_(const char* dico, const char* job, const char* fact, const char* trana, const int* n,
             double* A, const int* lda, double* U, const int* ldu, double* C, const int* ldc,
             double* scale, double* sep, double* ferr, double* wr, double* wi, int* iwork,
             double* dwork, const int* ldwork, int* info);
void openblas_set_num_threads(int threads);
}

namespace {

/// Processor time of a call in microseconds; of short ones that of many, beside which reading the
/// clock is nothing.
template <class Work>
double microseconds(Work&& work) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
  };
  constexpr double brief = 100.0;
  double elapsed = 0.0;
  int calls = 1;
  for (;; calls *= 16) {
    const double start = now();
    for (int k = 0; k < calls; ++k) {
      work();
    }
    elapsed = now() - start;
    if (elapsed > brief || calls > 1000) {
      return elapsed / calls;
    }
  }
}
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Equation {
  MatrixXd A, B, Q, R;
};

/// x'' = K x - 0.01 K' x' of masses in a row between two walls, pushed at the first.
Equation chain(int n) {
  const int masses = n / 2;
  MatrixXd K = MatrixXd::Zero(masses, masses);
  K.diagonal().setConstant(-2.0);
  K.diagonal(1).setOnes();
  K.diagonal(-1).setOnes();
  Equation e{MatrixXd::Zero(n, n), MatrixXd::Zero(n, 1), MatrixXd::Identity(n, n),
             MatrixXd::Identity(1, 1)};
  e.A.topRightCorner(masses, masses).setIdentity();
  e.A.bottomLeftCorner(masses, masses) = K;
  e.A.bottomRightCorner(masses, masses) = 0.01 * K;
  e.B(masses, 0) = 1.0;
  return e;
}

/// Heat along a rod of n cells, warmed at one end, its far quarter weighed.
Equation heat(int n) {
  Equation e{MatrixXd::Zero(n, n), MatrixXd::Zero(n, 1), MatrixXd::Zero(n, n),
             MatrixXd::Identity(1, 1)};
  const double k = 0.01 * (n + 1) * (n + 1);
  e.A.diagonal().setConstant(-2.0 * k);
  e.A.diagonal(1).setConstant(k);
  e.A.diagonal(-1).setConstant(k);
  e.B(0, 0) = k;
  e.Q.diagonal().tail(std::max(1, n / 4)).setOnes();
  return e;
}

/// Stable modes, and two unstable ones that the input reaches through a coupling of 1e-5 only.
Equation weakly_coupled(int n) {
  Equation e{MatrixXd::Zero(n, n), MatrixXd::Zero(n, 1), MatrixXd::Identity(n, n),
             MatrixXd::Identity(1, 1)};
  for (int i = 0; i < n; ++i) {
    e.A(i, i) = i < 2 ? 0.1 * (i + 1) : -0.5 * (i - 1) / n - 0.5;
  }
  e.A(0, 2 % n) = 1e-5;
  e.A(1, 3 % n) = 1e-5;
  e.B.col(0).tail(n - 2).setOnes();
  return e;
}

MatrixXd normal(flyball::Random& random, int rows, int columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&random] { return random.normal(); });
}

/// Random, one input.
Equation one_input(int n) {
  flyball::Random random(static_cast<std::uint64_t>(n));
  Equation e{normal(random, n, n), normal(random, n, 1), MatrixXd::Identity(n, n),
             MatrixXd::Identity(1, 1)};
  e.A /= std::sqrt(static_cast<double>(n));
  e.A.diagonal().array() -= 0.95;
  return e;
}

/// Random, the second half of the states stable and not reached.
Equation unreached(int n) {
  Equation e = one_input(n);
  const int half = n / 2;
  e.A.bottomLeftCorner(n - half, half).setZero();
  e.A.bottomRightCorner(n - half, n - half).diagonal().array() -= 1.0;
  e.B.bottomRows(n - half).setZero();
  return e;
}

/// The same with an unstable mode there: no solution.
Equation refused(int n) {
  Equation e = unreached(n);
  e.A.bottomRightCorner(n - n / 2, n - n / 2).diagonal().array() += 2.0;
  return e;
}

Equation sampled(const Equation& e) {
  const auto d = flyball::discretize(
      flyball::ContinuousSystem<>{e.A, e.B, MatrixXd::Identity(e.A.rows(), e.A.rows()),
                                  MatrixXd::Zero(e.A.rows(), e.B.cols())},
      flyball::Time(0.1));
  return {d->A, d->B, e.Q, e.R};
}

class Slicot {
 public:
  Slicot(int n, int m)
      : n_(n),
        m_(m),
        size_(2 * n + m),
        X_(n, n),
        real_(2 * n),
        imaginary_(2 * n),
        beta_(2 * n),
        S_(size_, size_),
        T_(size_, 2 * n),
        U_(2 * n, 2 * n),
        integers_(static_cast<std::size_t>(std::max({m, 2 * n, n * n}))),
        flags_(static_cast<std::size_t>(2 * n)),
        work_(std::max({7 * (2 * n + 1) + 16, 16 * n, 2 * n + m, 3 * m, 64 * size_, 2 * n * n})) {}

  int od(const Equation& e, const char* domain) {
    const int p = 0;
    const int one = 1;
    const int twice = 2 * n_;
    const int ldwork = static_cast<int>(work_.size());
    const double none = 0.0;
    double rcond = 0.0;
    int info = 0;
    sb02od_(domain, "B", "N", "U", "Z", "S", &n_, &m_, &p, e.A.data(), &n_, e.B.data(), &n_,
            e.Q.data(), &n_, e.R.data(), &m_, &none, &one, &rcond, X_.data(), &n_, real_.data(),
            imaginary_.data(), beta_.data(), S_.data(), &size_, T_.data(), &size_, U_.data(),
            &twice, &none, integers_.data(), work_.data(), &ldwork, flags_.data(), &info);
    return info;
  }
  int md(const Equation& e, const MatrixXd& G, const char* domain) {
    A_ = e.A;
    X_ = e.Q;
    const int twice = 2 * n_;
    const int ldwork = static_cast<int>(work_.size());
    double rcond = 0.0;
    int info = 0;
    sb02md_(domain, "D", "U", "G", "S", &n_, A_.data(), &n_, G.data(), &n_, X_.data(), &n_, &rcond,
            real_.data(), imaginary_.data(), S_.data(), &twice, U_.data(), &twice, integers_.data(),
            work_.data(), &ldwork, flags_.data(), &info);
    return info;
  }
  int lyapunov(const MatrixXd& A, const MatrixXd& C, const char* domain) {
    A_ = A;
    X_ = C;
    const int ldwork = static_cast<int>(work_.size());
    double scale = 0.0;
    double sep = 0.0;
    double error = 0.0;
    int info = 0;
    sb03md_(domain, "X", "N", "T", &n_, A_.data(), &n_, U_.data(), &n_, X_.data(), &n_, &scale,
            &sep, &error, real_.data(), imaginary_.data(), integers_.data(), work_.data(), &ldwork,
            &info);
    return info;
  }
  [[nodiscard]] const MatrixXd& X() const { return X_; }

 private:
  int n_, m_, size_;
  MatrixXd A_, X_;
  VectorXd real_, imaginary_, beta_;
  MatrixXd S_, T_, U_;
  std::vector<int> integers_, flags_;
  VectorXd work_;
};

/// ‖left‖/‖right‖ of the equation as X leaves it: of A'XA - X - … + Q, or A'X + XA - … + Q.
double residual(const Equation& e, const MatrixXd& X, bool continuous) {
  if (continuous) {
    const MatrixXd AX = e.A.transpose() * X;
    const MatrixXd BX = e.B.transpose() * X;
    const MatrixXd quadratic = BX.transpose() * e.R.llt().solve(BX);
    return (AX + AX.transpose() - quadratic + e.Q).norm() /
           (2.0 * AX.norm() + quadratic.norm() + e.Q.norm());
  }
  const MatrixXd AXA = e.A.transpose() * X * e.A;
  const MatrixXd BXA = e.B.transpose() * X * e.A;
  const MatrixXd quadratic = BXA.transpose() * (e.R + e.B.transpose() * X * e.B).llt().solve(BXA);
  return (AXA - X - quadratic + e.Q).norm() /
         (AXA.norm() + X.norm() + quadratic.norm() + e.Q.norm());
}

struct Peer {
  double time = 1e300;
  double error = 1e300;
};

void print(int n, double ours, double our_error, const std::vector<Peer>& peers) {
  std::printf("%5d %12.1f %9.0e", n, ours, our_error);
  for (const Peer& peer : peers) {
    if (peer.error < 1e300) {
      std::printf(" %12.1f %9.0e %7.2f", peer.time, peer.error, peer.time / ours);
    } else {
      std::printf(" %12.1f %9s %7.2f", peer.time, "fails", peer.time / ours);
    }
  }
  std::printf("\n");
  std::fflush(stdout);
}

int repetitions_for(int wanted, double once) {
  return std::clamp(static_cast<int>(2e6 / std::max(once, 1.0)), 1, wanted);
}

void compare_riccati(const Equation& e, bool continuous, int wanted) {
  const int n = static_cast<int>(e.A.rows());
  const char* const domain = continuous ? "C" : "D";
  Slicot slicot(n, static_cast<int>(e.B.cols()));
  const MatrixXd G = e.B * e.R.llt().solve(e.B.transpose());
  const auto solve = [&] {
    return continuous ? flyball::care(e.A, e.B, e.Q, e.R) : flyball::dare(e.A, e.B, e.Q, e.R);
  };
  double ours = microseconds([&] { (void)solve(); });
  std::vector<Peer> peers(2);
  const int repetitions = repetitions_for(wanted, ours);
  for (int r = 0; r < repetitions; ++r) {
    ours = std::min(ours, microseconds([&] { (void)solve(); }));
    int info[2] = {};
    peers[0].time = std::min(peers[0].time, microseconds([&] { info[0] = slicot.od(e, domain); }));
    if (info[0] == 0 && r == 0) {
      peers[0].error = residual(e, slicot.X(), continuous);
    }
    peers[1].time =
        std::min(peers[1].time, microseconds([&] { info[1] = slicot.md(e, G, domain); }));
    if (info[1] == 0 && r == 0) {
      peers[1].error = residual(e, slicot.X(), continuous);
    }
  }
  const auto answer = solve();
  print(n, ours, answer ? residual(e, answer->X, continuous) : NAN, peers);
}

void compare_lyapunov(const MatrixXd& A, bool continuous, int wanted) {
  const int n = static_cast<int>(A.rows());
  const MatrixXd Q = MatrixXd::Identity(n, n);
  const MatrixXd minus = -Q;
  Slicot slicot(n, 1);
  const auto solve = [&] {
    return continuous ? flyball::lyapunov(A, Q) : flyball::discrete_lyapunov(A, Q);
  };
  const auto error = [&](const MatrixXd& X) {
    const MatrixXd left = continuous ? MatrixXd(A * X + X * A.transpose() + Q)
                                     : MatrixXd(A * X * A.transpose() - X + Q);
    return left.norm() / (2.0 * (A * X).norm() + Q.norm());
  };
  double ours = microseconds([&] { (void)solve(); });
  std::vector<Peer> peers(1);
  const int repetitions = repetitions_for(wanted, ours);
  for (int r = 0; r < repetitions; ++r) {
    ours = std::min(ours, microseconds([&] { (void)solve(); }));
    int info = 0;
    peers[0].time =
        std::min(peers[0].time,
                 microseconds([&] { info = slicot.lyapunov(A, minus, continuous ? "C" : "D"); }));
    if (info == 0) {
      peers[0].error = error(slicot.X());
    }
  }
  const auto answer = solve();
  print(n, ours, answer ? error(answer->X) : NAN, peers);
}

}  // namespace

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  const int wanted = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  const int largest = argc > 2 ? std::atoi(argv[2]) : 200;
  struct Family {
    const char* name;
    Equation (*make)(int n);
  };
  const Family families[] = {{"chain of masses", &chain},
                             {"heat", &heat},
                             {"unstable, coupled by 1e-5", &weakly_coupled},
                             {"one input", &one_input},
                             {"modes not reached", &unreached},
                             {"no solution", &refused}};
  const std::string_view part = argc > 3 ? argv[3] : "";
  std::printf("minima in microseconds of processor time, one thread, with the residual of each\n");
  for (const bool continuous : {true, false}) {
    for (const Family& family : families) {
      const std::string heading = std::string(continuous ? "care, " : "dare, ") + family.name;
      if (heading.find(part) == std::string::npos) {
        continue;
      }
      std::printf("%s\n%5s %12s %9s %12s %9s %7s %12s %9s %7s\n", heading.c_str(), "n", "flyball",
                  "residual", "SB02OD", "residual", "ratio", "SB02MD", "residual", "ratio");
      for (const int n : {4, 10, 20, 50, 100, 200}) {
        if (n <= largest) {
          const Equation e = family.make(n);
          compare_riccati(continuous ? e : sampled(e), continuous, wanted);
        }
      }
    }
    for (const Family& family : {families[0], families[1]}) {
      const std::string heading =
          std::string(continuous ? "lyapunov, " : "discrete lyapunov, ") + family.name;
      if (heading.find(part) == std::string::npos) {
        continue;
      }
      std::printf("%s\n%5s %12s %9s %12s %9s %7s\n", heading.c_str(), "n", "flyball", "residual",
                  "SB03MD", "residual", "ratio");
      for (const int n : {4, 10, 20, 50, 100, 200}) {
        if (n <= largest) {
          const Equation e = family.make(n);
          compare_lyapunov(continuous ? e.A : sampled(e).A, continuous, wanted);
        }
      }
    }
  }
  return 0;
}
