% Octave's n4sid, moen4 and arx on the records that bench_subspace has written, one JSON object a
% line: smallest time of five calls in microseconds, and the fit of the free run on the record.
% usage: octave-cli octave_side.m FILE
pkg load control
file = fopen (argv (){1});
printf ("%10s %6s %3s %3s %8s %12s %10s\n", "function", "order", "m", "p", "samples", "us", "fit");
while (ischar (line = fgetl (file)))
  r = jsondecode (line);
  u = reshape (r.u, [], numel (r.u) / size (r.y, 1));
  y = reshape (r.y, size (u, 1), []);
  data = iddata (y, u, 0.01);
  for method = {@n4sid, @moen4, @arx}
    work = method{1};
    if (strcmp (func2str (work), "arx"))
      call = @() arx (data, "na", r.order, "nb", r.order);
    else
      call = @() work (data, r.order, "s", r.block_rows);
    endif
    best = Inf;
    for k = 1:5
      start = tic;
      [sys, x0] = call ();
      best = min (best, toc (start));
    endfor
    sys = ss (sys)(:, 1:columns (u));
    yhat = lsim (sys, u, [], x0);
    left = sqrt (sumsq (y - yhat, 1)) ./ sqrt (sumsq (y - mean (y, 1), 1));
    printf ("%10s %6d %3d %3d %8d %12.0f %10.4f\n", func2str (work), r.order, columns (u), ...
            columns (y), rows (u), best * 1e6, mean (1 - left));
  endfor
endwhile
