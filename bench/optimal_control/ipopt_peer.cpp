#include <algorithm>
#include <cstddef>
#include <ctime>
#include <vector>

#include "ipopt_peer.hpp"

#define HAVE_CSTDDEF  // what Debian's headers ask for
#include <coin/IpIpoptApplication.hpp>
#include <coin/IpSolveStatistics.hpp>
#include <coin/IpTNLP.hpp>

#include <flyball/math/expression/lane_tape.hpp>

namespace peer {

namespace {

using flyball::expression::Entry;
using flyball::expression::Lagrangian;
using flyball::expression::LaneTape;
using Ipopt::Index;
using Ipopt::Number;

constexpr std::size_t lanes = LaneTape::lanes;

/// A stage's functions and derivatives, compiled.
struct Compiled {
  explicit Compiled(const Lagrangian& functions)
      : of(functions), values(values_of(functions)), derivatives(functions.tape) {
    value_work.resize(values.workspace_size());
    derivative_work.resize(derivatives.workspace_size());
    values.prepare({}, value_work.data());
    derivatives.prepare({}, derivative_work.data());
  }
  const Lagrangian& of;
  LaneTape values, derivatives;
  std::vector<double> value_work, derivative_work;
};

class Nlp final : public Ipopt::TNLP {
 public:
  explicit Nlp(const StageProblem& problem)
      : p_(problem),
        n_(static_cast<std::size_t>(problem.states)),
        size_(n_ + static_cast<std::size_t>(problem.inputs)),
        N_(static_cast<std::size_t>(problem.intervals)),
        stage_(problem.stage),
        last_(problem.last) {}

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_h,
                    IndexStyleEnum& style) override {
    n = static_cast<Index>(size_ * (N_ + 1));
    m = static_cast<Index>(n_ * N_);
    nnz_jac = static_cast<Index>(N_ * (in_dynamics() + n_));
    nnz_h = static_cast<Index>(N_ * p_.stage.hessian.size() + p_.last.hessian.size());
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index n, Number* low, Number* high, Index m, Number* g_low,
                       Number* g_high) override {
    std::copy_n(p_.lower.data(), n, low);
    std::copy_n(p_.upper.data(), n, high);
    std::fill_n(g_low, m, 0.0);
    std::fill_n(g_high, m, 0.0);
    return true;
  }
  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override {
    std::copy_n(p_.start.data(), n, x);
    return true;
  }
  bool eval_f(Index, const Number* x, bool is_new, Number& f) override {
    look(x, is_new);
    f = f_;
    return true;
  }
  bool eval_g(Index, const Number* x, bool is_new, Index m, Number* g) override {
    look(x, is_new);
    std::copy_n(c_.data(), m, g);
    return true;
  }
  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override {
    std::fill_n(gradient, n, 0.0);
    differentiate(x, nullptr, 1.0, [&](std::size_t k, std::size_t, const Entry& e, double value) {
      if (e.row == (k < N_ ? n_ : 0)) {
        gradient[k * size_ + e.column] = value;
      }
    });
    return true;
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* columns,
                  Number* values) override {
    const std::size_t each = in_dynamics() + n_;
    if (values == nullptr) {
      for (std::size_t k = 0; k < N_; ++k) {
        std::size_t at = k * each;
        for (const Entry& e : p_.stage.jacobian) {
          if (e.row < n_) {
            rows[at] = static_cast<Index>(k * n_ + e.row);
            columns[at++] = static_cast<Index>(k * size_ + e.column);
          }
        }
        for (std::size_t i = 0; i < n_; ++i) {
          rows[at] = static_cast<Index>(k * n_ + i);
          columns[at++] = static_cast<Index>((k + 1) * size_ + i);
        }
      }
      return true;
    }
    std::vector<std::size_t> next(N_);
    for (std::size_t k = 0; k < N_; ++k) {
      next[k] = k * each;
      std::fill_n(values + k * each + in_dynamics(), n_, -1.0);
    }
    differentiate(x, nullptr, 1.0, [&](std::size_t k, std::size_t, const Entry& e, double value) {
      if (k < N_ && e.row < n_) {
        values[next[k]++] = value;
      }
    });
    return true;
  }
  bool eval_h(Index, const Number* x, bool, Number factor, Index, const Number* lambda, bool, Index,
              Index* rows, Index* columns, Number* values) override {
    const std::size_t each = p_.stage.hessian.size();
    if (values == nullptr) {
      for (std::size_t k = 0; k <= N_; ++k) {
        const auto& hessian = k < N_ ? p_.stage.hessian : p_.last.hessian;
        for (std::size_t e = 0; e < hessian.size(); ++e) {
          rows[k * each + e] = static_cast<Index>(k * size_ + hessian[e].row);
          columns[k * each + e] = static_cast<Index>(k * size_ + hessian[e].column);
        }
      }
      return true;
    }
    for_stages([&](Compiled& kind, std::size_t first, std::size_t count) {
      evaluate(kind, first, count, x, lambda, factor);
      const std::size_t begin = kind.of.rows + kind.of.jacobian.size();
      for (std::size_t e = 0; e < kind.of.hessian.size(); ++e) {
        const double* const y = kind.derivatives.output(begin + e, kind.derivative_work.data());
        for (std::size_t l = 0; l < count; ++l) {
          values[(first + l) * each + e] = y[l];
        }
      }
    });
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*,
                         Index, const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  [[nodiscard]] std::size_t in_dynamics() const {
    return static_cast<std::size_t>(std::count_if(p_.stage.jacobian.begin(),
                                                  p_.stage.jacobian.end(),
                                                  [this](const Entry& e) { return e.row < n_; }));
  }
  template <class Work>
  void for_stages(Work&& work) {
    for (std::size_t first = 0; first < N_; first += lanes) {
      work(stage_, first, std::min(lanes, N_ - first));
    }
    work(last_, N_, 1);
  }
  void gather(const LaneTape& tape, double* work, std::size_t first, std::size_t count,
              const Number* x) const {
    double* const to = tape.input(0, work);
    for (std::size_t i = 0; i < size_; ++i) {
      for (std::size_t l = 0; l < lanes; ++l) {
        to[i * lanes + l] = x[(first + std::min(l, count - 1)) * size_ + i];
      }
    }
  }
  void look(const Number* x, bool is_new) {
    if (!is_new && !c_.empty()) {
      return;
    }
    c_.resize(n_ * N_);
    f_ = 0.0;
    for_stages([&](Compiled& kind, std::size_t first, std::size_t count) {
      double* const work = kind.value_work.data();
      gather(kind.values, work, first, count, x);
      kind.values.evaluate(work);
      const std::size_t dynamics = kind.of.rows - 1;
      for (std::size_t l = 0; l < count; ++l) {
        for (std::size_t i = 0; i < dynamics; ++i) {
          c_[(first + l) * n_ + i] =
              kind.values.output(i, work)[l] - x[(first + l + 1) * size_ + i];
        }
        f_ += kind.values.output(dynamics, work)[l];
      }
    });
  }
  void evaluate(Compiled& kind, std::size_t first, std::size_t count, const Number* x,
                const Number* lambda, double factor) {
    double* const work = kind.derivative_work.data();
    gather(kind.derivatives, work, first, count, x);
    double* const mu = kind.derivatives.input(size_, work);
    const std::size_t dynamics = kind.of.rows - 1;
    for (std::size_t l = 0; l < lanes; ++l) {
      const std::size_t k = first + std::min(l, count - 1);
      for (std::size_t i = 0; i < dynamics; ++i) {
        mu[i * lanes + l] = lambda == nullptr ? 0.0 : lambda[k * n_ + i];
      }
      mu[dynamics * lanes + l] = factor;
    }
    kind.derivatives.evaluate(work);
  }
  template <class Take>
  void differentiate(const Number* x, const Number* lambda, double factor, Take&& take) {
    for_stages([&](Compiled& kind, std::size_t first, std::size_t count) {
      evaluate(kind, first, count, x, lambda, factor);
      for (std::size_t e = 0; e < kind.of.jacobian.size(); ++e) {
        const double* const y =
            kind.derivatives.output(kind.of.rows + e, kind.derivative_work.data());
        for (std::size_t l = 0; l < count; ++l) {
          take(first + l, e, kind.of.jacobian[e], y[l]);
        }
      }
    });
  }

  const StageProblem& p_;
  std::size_t n_, size_, N_;
  Compiled stage_, last_;
  double f_ = 0.0;
  std::vector<double> c_;
};

double process_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace

Result solve_with_ipopt(const StageProblem& problem) {
  const Ipopt::SmartPtr<Ipopt::TNLP> nlp = new Nlp(problem);
  const double begin = process_milliseconds();
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> ipopt = IpoptApplicationFactory();
  ipopt->Options()->SetIntegerValue("print_level", 0);
  ipopt->Options()->SetStringValue("sb", "yes");
  ipopt->Options()->SetNumericValue("tol", 1e-8);
  Result result;
  if (ipopt->Initialize() != Ipopt::Solve_Succeeded) {
    return result;
  }
  result.solved = ipopt->OptimizeTNLP(nlp) == Ipopt::Solve_Succeeded;
  result.milliseconds = process_milliseconds() - begin;
  result.iterations = ipopt->Statistics()->IterationCount();
  result.cost = ipopt->Statistics()->FinalObjective();
  return result;
}

}  // namespace peer
