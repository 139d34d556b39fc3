typedef unsigned long long count; typedef unsigned char flag;
DEVICE count mixed(count z){
 z+=0x9E3779B97F4A7C15ull;
 z=(z^(z>>30))*0xBF58476D1CE4E5B9ull;
 z=(z^(z>>27))*0x94D049BB133111EBull;
 return z^(z>>31);
}
KERNEL uniform(real*U){
UNIFORM_SCOPE
}
KERNEL begin(whole lanes,whole all,const count*seeds,count*episodes,const flag*done,const float*A,real*Z,real*M,real*S,real*Q){
 const whole n=lanes,lane=blockIdx.x*(whole)blockDim.x+threadIdx.x;
 if(lane>=n)return;
 EACH(k,NORDERS)S[(NAROUND+k)*n+lane]=A[lane*NORDERS+k];
 const flag fresh=all||done[lane];
 S[(NSERIES-1)*n+lane]=fresh?R(1.0):R(0.0);
 if(!fresh)return;
 const count key=mixed(mixed(seeds[lane])^episodes[lane]++);
 real u[NU1];
 EACH(k,NDRAWS)u[k]=(real)((mixed(key^mixed(k))>>11)*0x1p-53);
LANE_SCOPE
 BEGUN
}
KERNEL tell(whole lanes,in Y,real*Z,real*M,float*seen,double*reward,flag*over,flag*cut,flag*done,whole begun){
 const whole n=lanes,lane=blockIdx.x*(whole)blockDim.x+threadIdx.x;
 if(lane>=n)return;
 in y=Y+(NS+NM+NSEEN+3)*n+lane;
 EACH(i,NS)Z[i*n+lane]=y[i*n];
 EACH(i,NM)M[i*n+lane]=y[(NS+i)*n];
 EACH(i,NSEEN)seen[lane*NSEEN+i]=y[(NS+NM+i)*n];
 in judged=y+(NS+NM+NSEEN)*n;
 reward[lane]=judged[0];
 over[lane]=judged[n]>R(0.5); cut[lane]=judged[2*n]>R(0.5);
 done[lane]=!begun&&(over[lane]||cut[lane]);
}
