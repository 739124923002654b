// Subspace identification beside SLICOT's IB01AD, IB01BD and IB01CD (order, matrices, Kalman gain
// and initial state) on the same simulated records in the same process, one thread: `bench_subspace
// [repetitions [FILE]]`. Minima over repetitions that alternate between the two. With FILE the
// records are written there for octave_side.m.
//
// The fit is that of the free run on the record, 1 - ‖y - ŷ‖/‖y - mean‖, averaged over outputs; the
// error is that of the impulse response, relative to the truth's.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

#include <Eigen/LU>

#include <flyball/core/random.hpp>
#include <flyball/identification/subspace.hpp>
#include <flyball/io/json_writer.hpp>

#include "timing.hpp"

extern "C" {
void ib01ad_(const char* meth, const char* alg, const char* jobd, const char* batch,
             const char* conct, const char* ctrl, const int* nobr, const int* m, const int* l,
             const int* nsmp, const double* u, const int* ldu, const double* y, const int* ldy,
             int* n, double* r, const int* ldr, double* sv, const double* rcond, const double* tol,
             int* iwork, double* dwork, const int* ldwork, int* iwarn, int* info);
void ib01bd_(const char* meth, const char* job, const char* jobck, const int* nobr, const int* n,
             const int* m, const int* l, const int* nsmpl, double* r, const int* ldr, double* a,
             const int* lda, double* c, const int* ldc, double* b, const int* ldb, double* d,
             const int* ldd, double* q, const int* ldq, double* ry, const int* ldry, double* s,
             const int* lds, double* k, const int* ldk, const double* tol, int* iwork,
             double* dwork, const int* ldwork, int* bwork, int* iwarn, int* info);
void ib01cd_(const char* jobx0, const char* comuse, const char* job, const int* n, const int* m,
             const int* l, const int* nsmp, const double* a, const int* lda, double* b,
             const int* ldb, const double* c, const int* ldc, double* d, const int* ldd, double* u,
             const int* ldu, const double* y, const int* ldy, double* x0, double* v, const int* ldv,
             const double* tol, int* iwork, double* dwork, const int* ldwork, int* iwarn,
             int* info);
void openblas_set_num_threads(int threads);
}

namespace {

using bench::microseconds;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::DiscreteSystem;
using flyball::identification::InnovationsModel;
using flyball::identification::SubspaceWeighting;

const flyball::Time period(0.01);

struct Record {
  InnovationsModel truth;
  MatrixXd u;
  MatrixXd y;
  int order;
  int block_rows;
};

MatrixXd normal(flyball::Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  return M;
}

/// Poles of size 0.5 to 0.97 in any states; noise of a tenth of the outputs, through K and at them.
Record record(flyball::Random& random, int n, int m, int p, int samples, bool badly_scaled) {
  Record made;
  made.order = n;
  made.block_rows = std::max(2 * n, 6);
  MatrixXd A = MatrixXd::Zero(n, n);
  for (int i = 0; i + 1 < n; i += 2) {
    const double size = random.uniform(0.5, 0.97);
    const double angle = random.uniform(0.05, 2.0);
    A.block(i, i, 2, 2) << size * std::cos(angle), size * std::sin(angle), -size * std::sin(angle),
        size * std::cos(angle);
  }
  const MatrixXd V = normal(random, n, n) + 2.0 * MatrixXd::Identity(n, n);
  made.truth = {{V * A * V.inverse(), normal(random, n, m), normal(random, p, n),
                 normal(random, p, m), period},
                0.05 * normal(random, n, p),
                MatrixXd::Identity(p, p),
                VectorXd::Zero(n)};
  made.u = normal(random, samples, m);
  const MatrixXd clean = flyball::identification::simulate(made.truth, made.u).value();
  const double size = clean.norm() / std::sqrt(static_cast<double>(clean.size()));
  const MatrixXd e = 0.1 * size * normal(random, samples, p);
  // The part of the noise that passes the states.
  InnovationsModel noise = made.truth;
  noise.system.B = made.truth.K;
  noise.system.D = MatrixXd::Identity(p, p);
  made.y = clean + flyball::identification::simulate(noise, e).value();
  if (badly_scaled) {
    for (int j = 0; j < m; ++j) {
      const double unit = std::pow(10.0, j % 2 == 0 ? 4 : -3);
      made.u.col(j) *= unit;
      made.truth.system.B.col(j) /= unit;
      made.truth.system.D.col(j) /= unit;
    }
    for (int i = 0; i < p; ++i) {
      const double unit = std::pow(10.0, i % 2 == 0 ? -5 : 2);
      made.y.col(i) *= unit;
      made.truth.system.C.row(i) *= unit;
      made.truth.system.D.row(i) *= unit;
    }
  }
  return made;
}

/// SLICOT with its workspace allocated once, which is the peer's best case.
class Slicot {
 public:
  explicit Slicot(const Record& record)
      : n_(record.order),
        m_(static_cast<int>(record.u.cols())),
        p_(static_cast<int>(record.y.cols())),
        samples_(static_cast<int>(record.u.rows())),
        s_(record.block_rows),
        rows_(std::max(2 * (m_ + p_) * s_, 3 * m_ * s_)),
        R_(rows_, 2 * (m_ + p_) * s_),
        values_(p_ * s_),
        Q_(n_, n_),
        Ry_(p_, p_),
        S_(n_, p_),
        V_(n_, n_),
        integers_(100'000),
        flags_(static_cast<std::size_t>(2 * n_ + 10)),
        work_(4'000'000 + static_cast<std::size_t>(samples_) * 200) {
    model.system = {MatrixXd(n_, n_), MatrixXd(n_, m_), MatrixXd(p_, n_), MatrixXd(p_, m_), period};
    model.K.resize(n_, p_);
    model.noise = MatrixXd::Identity(p_, p_);
    model.x0.resize(n_);
  }

  int fit(const Record& record, const char* first, const char* second, const char* algorithm) {
    const double zero = 0.0;
    const int size = static_cast<int>(work_.size());
    int order = 0;
    int warning = 0;
    int info = 0;
    ib01ad_(first, algorithm, "M", "O", "N", "N", &s_, &m_, &p_, &samples_, record.u.data(),
            &samples_, record.y.data(), &samples_, &order, R_.data(), &rows_, values_.data(), &zero,
            &zero, integers_.data(), work_.data(), &size, &warning, &info);
    if (info != 0) {
      return info;
    }
    DiscreteSystem<>& system = model.system;
    ib01bd_(second, "A", "K", &s_, &n_, &m_, &p_, &samples_, R_.data(), &rows_, system.A.data(),
            &n_, system.C.data(), &p_, system.B.data(), &n_, system.D.data(), &p_, Q_.data(), &n_,
            Ry_.data(), &p_, S_.data(), &n_, model.K.data(), &n_, &zero, integers_.data(),
            work_.data(), &size, flags_.data(), &warning, &info);
    if (info != 0) {
      return info;
    }
    MatrixXd u = record.u;
    ib01cd_("X", "U", "D", &n_, &m_, &p_, &samples_, system.A.data(), &n_, system.B.data(), &n_,
            system.C.data(), &p_, system.D.data(), &p_, u.data(), &samples_, record.y.data(),
            &samples_, model.x0.data(), V_.data(), &n_, &zero, integers_.data(), work_.data(),
            &size, &warning, &info);
    return info;
  }

  InnovationsModel model;

 private:
  int n_, m_, p_, samples_, s_, rows_;
  MatrixXd R_;
  VectorXd values_;
  MatrixXd Q_, Ry_, S_, V_;
  std::vector<int> integers_, flags_;
  std::vector<double> work_;
};

double fit_of(const InnovationsModel& model, const Record& record) {
  const auto simulated = flyball::identification::simulate(model, record.u);
  return simulated ? flyball::identification::fit_of(record.y, *simulated)->mean() : -1.0;
}

double error_of(const InnovationsModel& model, const Record& record) {
  const auto part = [](const DiscreteSystem<>& system, MatrixXd& power) {
    const MatrixXd now = system.C * power;
    power = system.A * power;
    return now;
  };
  MatrixXd ours = model.system.B;
  MatrixXd truth = record.truth.system.B;
  // In units in which every entry of the truth's response is of one size.
  MatrixXd error = (model.system.D - record.truth.system.D).cwiseAbs2();
  MatrixXd size = record.truth.system.D.cwiseAbs2();
  for (int k = 0; k < 100; ++k) {
    const MatrixXd expected = part(record.truth.system, truth);
    error += (part(model.system, ours) - expected).cwiseAbs2();
    size += expected.cwiseAbs2();
  }
  return std::sqrt(error.cwiseQuotient(size).mean());
}

}  // namespace

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 20;
  std::ofstream file;
  if (argc > 2) {
    file.open(argv[2]);
  }
  struct Method {
    const char* name;
    SubspaceWeighting weighting;
    const char* first;
    const char* second;
  };
  const Method methods[] = {{"MOESP", SubspaceWeighting::moesp, "M", "M"},
                            {"N4SID", SubspaceWeighting::n4sid, "N", "N"},
                            {"CVA / combined", SubspaceWeighting::cva, "M", "C"}};
  struct Size {
    int n, m, p, samples;
    bool bad;
  };
  const Size sizes[] = {{2, 1, 1, 1000, false}, {4, 1, 1, 1000, false}, {4, 2, 2, 2000, false},
                        {4, 2, 2, 2000, true},  {8, 2, 3, 4000, false}, {8, 2, 3, 4000, true},
                        {6, 1, 1, 20000, false}};
  constexpr int records = 5;
  std::printf(
      "| method | n | m | p | samples | scaled | ours, us | SLICOT C, us | ratio | least | "
      "SLICOT F, us | ratio | fit | SLICOT's | worst difference | error | SLICOT's |\n");
  std::printf(
      "|---|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const Method& method : methods) {
    flyball::Random random(7);
    for (const Size& size : sizes) {
      double ours_sum = 0.0, cholesky_sum = 0.0, fast_sum = 0.0, least = 1e9;
      double fit_ours = 0.0, fit_peer = 0.0, worst = 1e9, error_ours = 0.0, error_peer = 0.0;
      for (int r = 0; r < records; ++r) {
        const Record data = record(random, size.n, size.m, size.p, size.samples, size.bad);
        if (file.is_open() && method.weighting == SubspaceWeighting::moesp) {
          flyball::JsonWriter json;
          json.object([&] {
            json.add("order", data.order);
            json.add("block_rows", data.block_rows);
            json.add("u", data.u);
            json.add("y", data.y);
          });
          file << std::move(json).text() << '\n';
        }
        Slicot slicot(data);
        flyball::identification::SubspaceOptions options;
        options.order = data.order;
        options.block_rows = data.block_rows;
        options.weighting = method.weighting;
        InnovationsModel ours;
        double best[3] = {1e18, 1e18, 1e18};
        for (int k = 0; k < repetitions; ++k) {
          best[0] = std::min(
              best[0], microseconds(1, [&] {
                ours =
                    flyball::identification::fit_subspace(data.u, data.y, period, options)->model;
              }));
          best[2] = std::min(best[2], microseconds(1, [&] {
                               slicot.fit(data, method.first, method.second, "F");
                             }));
          int info = 0;
          best[1] = std::min(best[1], microseconds(1, [&] {
                               info = slicot.fit(data, method.first, method.second, "C");
                             }));
          if (info != 0) {
            std::printf("SLICOT: %d\n", info);
          }
        }
        ours_sum += best[0] / records;
        cholesky_sum += best[1] / records;
        fast_sum += best[2] / records;
        least = std::min(least, best[1] / best[0]);
        const double mine = fit_of(ours, data);
        const double theirs = fit_of(slicot.model, data);
        fit_ours += mine / records;
        fit_peer += theirs / records;
        worst = std::min(worst, mine - theirs);
        error_ours += error_of(ours, data) / records;
        error_peer += error_of(slicot.model, data) / records;
      }
      std::printf(
          "| %s | %d | %d | %d | %d | %s | %.0f | %.0f | %.2f | %.2f | %.0f | %.2f | %.4f | "
          "%.4f | %+.4f | %.4f | %.4f |\n",
          method.name, size.n, size.m, size.p, size.samples, size.bad ? "badly" : "well", ours_sum,
          cholesky_sum, cholesky_sum / ours_sum, least, fast_sum, fast_sum / ours_sum, fit_ours,
          fit_peer, worst, error_ours, error_peer);
    }
  }
}
