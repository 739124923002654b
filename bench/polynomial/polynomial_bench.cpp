// Polynomial fits beside Octave's arx (control package; it has no ARMAX and no output error) on the
// same records in one run: `bench_polynomial OCTAVE_SIDE_M [repetitions]`. Processor time of whole
// calls, minima; Octave's are measured inside of its one process, one thread.
//
// The fit is that one sample ahead, of both on the same samples: 1 - ‖y - ŷ‖/‖y - mean‖.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/identification/polynomial_model.hpp>
#include <flyball/io/json_writer.hpp>

namespace {

using Eigen::Index;
using Eigen::VectorXd;
using flyball::identification::PolynomialFit;
using flyball::identification::PolynomialOrders;

const flyball::Time period(0.01);

double processor_microseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

/// y of b/a x from rest, polynomials in the delay.
VectorXd filtered(const VectorXd& b, const VectorXd& a, const VectorXd& x) {
  VectorXd y(x.size());
  for (Index k = 0; k < x.size(); ++k) {
    double sum = 0.0;
    for (Index i = 0; i < b.size() && i <= k; ++i) {
      sum += b(i) * x(k - i);
    }
    for (Index i = 1; i < a.size() && i <= k; ++i) {
      sum -= a(i) * y(k - i);
    }
    y(k) = sum;
  }
  return y;
}

/// Π (1 - 2 r cos φ q⁻¹ + r² q⁻²) of pairs of roots, and a real one for an odd order.
VectorXd polynomial(flyball::Random& random, int order, double least, double most) {
  VectorXd p = VectorXd::Ones(1);
  const auto times = [&p](const VectorXd& factor) {
    VectorXd product = VectorXd::Zero(p.size() + factor.size() - 1);
    for (Index i = 0; i < factor.size(); ++i) {
      product.segment(i, p.size()) += factor(i) * p;
    }
    p = VectorXd(product);
  };
  for (int i = 0; i + 1 < order; i += 2) {
    const double r = random.uniform(least, most);
    times(Eigen::Vector3d(1.0, -2.0 * r * std::cos(random.uniform(0.1, 1.5)), r * r));
  }
  if (order % 2 != 0) {
    times(Eigen::Vector2d(1.0, -random.uniform(least, most)));
  }
  return p;
}

struct Kind {
  const char* name;
  int a, b, c, f;  ///< Of the truth.
  Index samples;
  enum { white, slow, badly_scaled, near_cancellation } data;
};

struct Record {
  VectorXd u;
  VectorXd y;
};

Record record(flyball::Random& random, const Kind& kind) {
  const auto normal = [&] {
    VectorXd x(kind.samples);
    for (double& value : x) {
      value = random.normal();
    }
    return x;
  };
  const VectorXd A = polynomial(random, kind.a, 0.5, 0.97);
  const VectorXd F = polynomial(random, kind.f, 0.5, 0.97);
  const VectorXd C = polynomial(random, kind.c, 0.3, 0.9);
  VectorXd B(kind.b + 1);
  B(0) = 0.0;
  for (Index i = 1; i < B.size(); ++i) {
    B(i) = random.normal();
  }
  if (kind.data == Kind::near_cancellation) {
    // Zeros a thousandth beside the poles.
    B.tail(kind.b) = A.head(kind.b);
    B(kind.b) *= 1.001;
  }
  Record made{normal(), {}};
  const VectorXd one = VectorXd::Ones(1);
  if (kind.data == Kind::slow) {
    made.u = filtered(one, Eigen::Vector2d(1.0, -0.95), made.u);
  }
  const VectorXd clean = filtered(one, A, filtered(B, F, made.u));
  const VectorXd e = filtered(C, A, normal());
  made.y = clean + 0.1 * clean.norm() / e.norm() * e;
  if (kind.data == Kind::badly_scaled) {
    made.u *= 1e4;
    made.y *= 1e-5;
  }
  return made;
}

/// Of the ARX model of coefficients a, b, one sample ahead, after the first ones.
double fit_ahead(const Record& record, int a, int b, const VectorXd& coefficients) {
  const Index first = std::max(a, b);
  const Index count = record.y.size() - first;
  const VectorXd y = record.y.tail(count);
  VectorXd left = y;
  for (Index i = 0; i < a; ++i) {
    left += coefficients(i) * record.y.segment(first - 1 - i, count);
  }
  for (Index i = 0; i < b; ++i) {
    left -= coefficients(a + i) * record.u.segment(first - 1 - i, count);
  }
  return 1.0 - left.norm() / (y.array() - y.mean()).matrix().norm();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::puts("usage: bench_polynomial octave_side.m [repetitions]");
    return 2;
  }
  const int repetitions = argc > 2 ? std::atoi(argv[2]) : 50;
  const Kind kinds[] = {{"ARX", 2, 2, 0, 0, 1000, Kind::white},
                        {"ARX", 6, 6, 0, 0, 10000, Kind::white},
                        {"ARX", 4, 4, 0, 0, 2000, Kind::slow},
                        {"ARX", 4, 4, 0, 0, 2000, Kind::badly_scaled},
                        {"ARX", 4, 4, 0, 0, 2000, Kind::near_cancellation},
                        {"ARX", 20, 20, 0, 0, 10000, Kind::white},
                        {"ARMAX", 2, 2, 2, 0, 1000, Kind::white},
                        {"ARMAX", 4, 4, 4, 0, 4000, Kind::slow},
                        {"OE", 0, 2, 0, 2, 1000, Kind::white},
                        {"OE", 0, 4, 0, 4, 4000, Kind::badly_scaled}};
  constexpr const char* names[] = {"white", "slow", "badly scaled", "near cancellation"};
  constexpr int records = 3;
  flyball::Random random(11);
  const std::string file = "/tmp/bench_polynomial." + std::to_string(std::clock()) + ".jsonl";
  std::ofstream out(file);
  std::vector<Record> all;
  for (const Kind& kind : kinds) {
    for (int r = 0; r < records; ++r) {
      all.push_back(record(random, kind));
      flyball::JsonWriter json;
      json.object([&] {
        // Of a record of another kind the ARX model of as many coefficients.
        json.add("a", kind.a + kind.f);
        json.add("b", kind.b);
        json.add("u", all.back().u);
        json.add("y", all.back().y);
      });
      out << std::move(json).text() << '\n';
    }
  }
  out.close();
  std::FILE* octave = popen(("OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 octave-cli --norc " +
                             std::string(argv[1]) + " " + file + " 2>/dev/null")
                                .c_str(),
                            "r");
  if (octave == nullptr) {
    std::puts("octave-cli does not run");
    return 1;
  }
  std::puts(
      "| record | a | b | c | f | samples | data | ours, us | Octave's arx, us | ratio | fit | "
      "Octave's | worst difference |");
  std::puts("|---|---:|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|");
  std::size_t next = 0;
  for (const Kind& kind : kinds) {
    double ours = 0.0, peer = 0.0, fit_ours = 0.0, fit_peer = 0.0, worst = 1e9;
    for (int r = 0; r < records; ++r) {
      const Record& data = all[next++];
      const PolynomialOrders orders{.a = kind.a, .b = kind.b, .c = kind.c, .f = kind.f};
      const bool linear = kind.c == 0 && kind.f == 0;
      double best = 1e18;
      double mine = 0.0;
      for (int k = 0; k < repetitions; ++k) {
        const double start = processor_microseconds();
        const auto fit =
            linear ? flyball::identification::fit_arx(data.u, data.y, period, orders)
                   : flyball::identification::fit_prediction_error(data.u, data.y, period, orders);
        best = std::min(best, processor_microseconds() - start);
        if (!fit) {
          std::printf("%s\n", flyball::to_string(fit.error()).c_str());
          return 1;
        }
        mine = linear ? fit_ahead(data, kind.a, kind.b, fit->parameters) : fit->prediction_fit;
      }
      char line[4096];
      if (std::fgets(line, sizeof line, octave) == nullptr) {
        std::puts("Octave has no answer: is its control package installed?");
        return 1;
      }
      std::istringstream text(line);
      double time = 0.0;
      text >> time;
      VectorXd coefficients(kind.a + kind.f + kind.b);
      for (double& value : coefficients) {
        text >> value;
      }
      const double theirs = fit_ahead(data, kind.a + kind.f, kind.b, coefficients);
      ours += best / records;
      peer += time / records;
      fit_ours += mine / records;
      fit_peer += theirs / records;
      worst = std::min(worst, mine - theirs);
    }
    std::printf("| %s | %d | %d | %d | %d | %d | %s | %.0f | %.0f | %.1f | %.6f | %.6f | %+.1e |\n",
                kind.name, kind.a, kind.b, kind.c, kind.f, static_cast<int>(kind.samples),
                names[kind.data], ours, peer, peer / ours, fit_ours, fit_peer, worst);
  }
  pclose(octave);
  std::remove(file.c_str());
}
