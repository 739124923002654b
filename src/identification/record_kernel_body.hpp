#pragma once

// Part of record_kernel_baseline.cpp and record_kernel_wide.cpp: compiled once for each instruction
// set, in its own namespace (see instruction_set.hpp). FLYBALL_HOLD keeps lanes in a register where
// each of their products would load them again, across lines of the cache.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

using RecordLanes = Vector4;
inline constexpr int record_lanes = 4;

/// `First` signals with one other, 4 `Vectors` lags.
template <int First, int Vectors>
[[gnu::always_inline]] inline void lag_tile(int count, const double* w, int step,
                                            const double* late, double* products, int apart) {
  RecordLanes sums[First][Vectors] = {};
  for (int t = 0; t < count; ++t) {
    RecordLanes lanes[Vectors];
    for (int v = 0; v < Vectors; ++v) {
      lanes[v] = load<RecordLanes>(late + t + record_lanes * v);
      FLYBALL_HOLD(lanes[v]);
    }
    for (int i = 0; i < First; ++i) {
      const double now = w[t + i * step];
      for (int v = 0; v < Vectors; ++v) {
        sums[i][v] += now * lanes[v];
      }
    }
  }
  for (int i = 0; i < First; ++i) {
    for (int v = 0; v < Vectors; ++v) {
      double* to = products + i * apart + record_lanes * v;
      store<RecordLanes>(to, load<RecordLanes>(to) + sums[i][v]);
    }
  }
}

template <int First>
[[gnu::always_inline]] inline void lag_row(int count, const double* w, int step, const double* late,
                                           double* products, int apart) {
  int done = 0;
  const auto tile = [&]<int Vectors>() {
    lag_tile<First, Vectors>(count, w, step, late + done, products + done, apart);
    done += record_lanes * Vectors;
  };
  // As many sums as registers hold, as evenly as the lags allow.
  constexpr int most = First == 3 ? 3 : 4;
  while (done < apart) {
    const int left = (apart - done) / record_lanes;
    switch (left <= most ? left : left < 2 * most ? (left + 1) / 2 : most) {
      case 1:
        tile.template operator()<1>();
        break;
      case 2:
        tile.template operator()<2>();
        break;
      case 3:
        tile.template operator()<3>();
        break;
      default:
        tile.template operator()<most>();
    }
  }
}

void lag_products(RecordView record, int count, int lags, double* products) {
  const int apart = (lags + record_lanes - 1) / record_lanes * record_lanes;
  for (int i = 0; i < record.signals * record.signals * apart; ++i) {
    products[i] = 0.0;
  }
  // So many samples of all signals stay near the processor, and the sums are sums of sums.
  constexpr int together = 1024;
  for (int from = 0; from < count; from += together) {
    const int part = count - from < together ? count - from : together;
    const double* w = record.at + from;
    for (int j = 0; j < record.signals; ++j) {
      const double* late = w + j * record.step;
      double* to = products + j * record.signals * apart;
      int i = 0;
      const auto take = [&]<int First>() {
        lag_row<First>(part, w + i * record.step, record.step, late, to + i * apart, apart);
        i += First;
      };
      while (record.signals - i >= 5 || record.signals - i == 3) {
        take.template operator()<3>();
      }
      if (record.signals - i == 4) {
        take.template operator()<2>();
      }
      if (record.signals - i >= 2) {
        take.template operator()<2>();
      }
      if (record.signals - i == 1) {
        take.template operator()<1>();
      }
    }
  }
}

/// to = M from + g in, 4 `Vectors` rows; `Columns` of them where that is known, else `columns`.
template <int Columns, int Vectors>
[[gnu::always_inline]] inline void advance(const double* M, int step, int columns,
                                           const double* from, const double* g, double in,
                                           double* to) {
  RecordLanes even[Vectors];
  RecordLanes odd[Vectors] = {};
  for (int v = 0; v < Vectors; ++v) {
    even[v] = load<RecordLanes>(g + record_lanes * v) * in;
  }
  const int count = Columns > 0 ? Columns : columns;
  int l = 0;
  for (; l + 2 <= count; l += 2) {
    const double a = from[l];
    const double b = from[l + 1];
    for (int v = 0; v < Vectors; ++v) {
      even[v] += load<RecordLanes>(M + l * step + record_lanes * v) * a;
      odd[v] += load<RecordLanes>(M + (l + 1) * step + record_lanes * v) * b;
    }
  }
  if (l < count) {
    const double a = from[l];
    for (int v = 0; v < Vectors; ++v) {
      even[v] += load<RecordLanes>(M + l * step + record_lanes * v) * a;
    }
  }
  for (int v = 0; v < Vectors; ++v) {
    store<RecordLanes>(to + record_lanes * v, even[v] + odd[v]);
  }
}

/// Signals of `count` samples beside each other: the inputs, then the outputs, which the filter
/// replaces.
inline void gather(const RecordView& record, int first, int count, double* rows, int rows_step) {
  for (int j = 0; j < record.signals; ++j) {
    const double* from = record.at + j * record.step + first;
    for (int k = 0; k < count; ++k) {
      rows[k * rows_step + j] = from[k];
    }
  }
}

/// A block of samples: columns of `rows_step` numbers, the states of the column after the last too.
/// @param x  The state of the filter of y, and room for its lanes twice.
template <int N, int StateVectors, int BothVectors>
inline void filter_samples(const RecordView& record, const RecordFilter& filter, int count,
                           int filtered, double* rows, int rows_step, double* x) {
  const int n = N > 0 ? N : filter.states;
  const int m = filter.inputs;
  const int outputs = record.signals - m;
  const int state_step = record_lanes * StateVectors;
  constexpr int both_step = record_lanes * BothVectors;
  const double* g = filter.F + n * state_step;
  double turns[2][record_lanes * (BothVectors + 1)] = {};
  for (int i = 0; i < n; ++i) {
    turns[0][i] = x[i];
  }
  for (int k = 0; k < count; ++k) {
    double* now = rows + k * rows_step;
    const double* from = now + record.signals;
    double* to = now + rows_step + record.signals;
    for (int j = 0; j < filtered; ++j, from += n, to += n) {
      advance<N, StateVectors>(filter.F, state_step, n, from, g, j < m ? now[j] : 0.0, to);
    }
    double* both_next = turns[(k + 1) % 2];
    const double* both = turns[k % 2];
    advance<N, BothVectors>(filter.both, both_step, n, both, filter.both + n * both_step, now[m],
                            both_next);
    for (int r = 1; r < outputs; ++r) {
      const double in = now[m + r];
      const double* column = filter.both + (n + r) * both_step;
      for (int v = 0; v < BothVectors; ++v) {
        double* lanes = both_next + record_lanes * v;
        store<RecordLanes>(
            lanes, load<RecordLanes>(lanes) + load<RecordLanes>(column + record_lanes * v) * in);
      }
    }
    // Three by hand: a loop becomes a call that copies memory.
    now[m] = both_next[n];
    if (outputs > 1) {
      now[m + 1] = both_next[n + 1];
    }
    if (outputs > 2) {
      now[m + 2] = both_next[n + 2];
    }
    for (int r = 3; r < outputs; ++r) {
      now[m + r] = both_next[n + r];
    }
  }
  for (int i = 0; i < n; ++i) {
    x[i] = turns[count % 2][i];
  }
}

/// The same for any number of states.
inline void filter_many(const RecordView& record, const RecordFilter& filter, int count,
                        int filtered, double* rows, int rows_step, double* x, double* result) {
  const int n = filter.states;
  const int m = filter.inputs;
  const int outputs = record.signals - m;
  const int state_step = (n + record_lanes - 1) / record_lanes * record_lanes;
  const int both_rows = n + outputs;
  const int both_step = (both_rows + record_lanes - 1) / record_lanes * record_lanes;
  const double* g = filter.F + n * state_step;
  for (int k = 0; k < count; ++k) {
    double* now = rows + k * rows_step;
    const double* from = now + record.signals;
    double* to = now + rows_step + record.signals;
    for (int j = 0; j < filtered; ++j, from += n, to += n) {
      const double u = j < m ? now[j] : 0.0;
      for (int i = 0; i < n; ++i) {
        to[i] = g[i] * u;
      }
      for (int l = 0; l < n; ++l) {
        const double* column = filter.F + l * state_step;
        const double by = from[l];
        for (int i = 0; i < n; ++i) {
          to[i] += column[i] * by;
        }
      }
    }
    for (int i = 0; i < both_rows; ++i) {
      result[i] = 0.0;
    }
    for (int l = 0; l < both_rows; ++l) {
      const double* column = filter.both + l * both_step;
      const double by = l < n ? x[l] : now[m + l - n];
      for (int i = 0; i < both_rows; ++i) {
        result[i] += column[i] * by;
      }
    }
    for (int i = 0; i < n; ++i) {
      x[i] = result[i];
    }
    for (int r = 0; r < outputs; ++r) {
      now[m + r] = result[n + r];
    }
  }
}

void sum_filtered(RecordView record, const RecordFilter& filter, double* sums, int sums_step,
                  double* memory) {
  const int n = filter.states;
  int rows = filter_rows(filter, record.signals);
  // The last states' lanes lie beyond them.
  const int rows_step = (rows + 3 + record_lanes) / record_lanes * record_lanes;
  double* block = memory;
  double* x = block + rows_step * (filter_block + 1) + record_lanes;
  double* result = x + n + record.signals;
  for (double* at = block; at < result; ++at) {
    *at = 0.0;
  }
  for (int i = 0; filter.x0 != nullptr && i < n; ++i) {
    x[i] = filter.x0[i];
  }
  int filtered = filter.inputs + (filter.impulse ? 1 : 0);
  double* impulse = block + rows - n;
  const int state_vectors = (n + record_lanes - 1) / record_lanes;
  const int both_vectors = (n + record.signals - filter.inputs + record_lanes - 1) / record_lanes;
  for (int i = 0; filter.impulse && i < n; ++i) {
    impulse[i] = filter.F[n * record_lanes * state_vectors + i];
  }
  const auto impulse_size = [&] {
    double size = 0.0;
    for (int i = 0; i < n; ++i) {
      size += impulse[i] * impulse[i];
    }
    return size;
  };
  double largest = filter.impulse ? impulse_size() : 0.0;
  for (int first = 0; first < record.samples; first += filter_block) {
    const int count = record.samples - first < filter_block ? record.samples - first : filter_block;
    gather(record, first, count, block, rows_step);
    const auto run = [&]<int N>() {
      constexpr int vectors = N > 0 ? (N + record_lanes - 1) / record_lanes : 3;
      if (both_vectors == vectors) {
        filter_samples<N, vectors, vectors>(record, filter, count, filtered, block, rows_step, x);
      } else if (both_vectors == vectors + 1) {
        filter_samples<N, vectors, vectors + 1>(record, filter, count, filtered, block, rows_step,
                                                x);
      } else {
        filter_many(record, filter, count, filtered, block, rows_step, x, result);
      }
    };
    switch (n) {
      case 1:
        run.template operator()<1>();
        break;
      case 2:
        run.template operator()<2>();
        break;
      case 3:
        run.template operator()<3>();
        break;
      case 4:
        run.template operator()<4>();
        break;
      case 5:
        run.template operator()<5>();
        break;
      case 6:
        run.template operator()<6>();
        break;
      case 7:
        run.template operator()<7>();
        break;
      case 8:
        run.template operator()<8>();
        break;
      case 9:
      case 10:
      case 11:
      case 12:
        run.template operator()<0>();
        break;
      default:
        filter_many(record, filter, count, filtered, block, rows_step, x, result);
    }
    add_panel_product(rows, filter.squares ? rows : record.signals, count, 1.0, {block, rows_step},
                      {block, rows_step, 1}, sums, sums_step, true);
    const double* last = block + count * rows_step;
    for (int i = record.signals; i < rows; ++i) {
      block[i] = last[i];
    }
    if (filtered > filter.inputs) {
      // What has shrunk so far adds nothing more, whatever it still grows by.
      const double size = impulse_size();
      largest = size > largest ? size : largest;
      if (size <= 1e-50 * largest) {
        --filtered;
        rows -= n;
      }
    }
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
