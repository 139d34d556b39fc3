#define V __attribute__((simd("notinbranch"),const))
V double sin(double); V double cos(double); V double exp(double); V double log(double);
V double tanh(double); V double asin(double); V double acos(double); V double atan(double);
V double atan2(double,double); V double pow(double,double);
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define floor __builtin_floor
#define INF __builtin_inf()
#define NAN_ __builtin_nan("")
#define LB 16
typedef const double* restrict in; typedef double* restrict out;
