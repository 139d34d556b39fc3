#define COLUMN (NS*LB)
long room(void){return NC*COLUMN+4*NJ*LB;}
void sensitivity(long b0,long b1,long T,double dt,long every,long rk4,in Z0,in S,long sb,long st,in Q,in P,out Y,out D,long rows,out work){
for(long blk=b0;blk<b1;blk++){
 double z[NS*LB],w[NS*LB],g[NS*LB],held[NH*LB],v[COLUMN],h[COLUMN];
 double*d=work,*y=work+NC*COLUMN; const long J=NJ*LB;
 const double*q=Q+blk*NQ*LB; double*o=Y+blk*rows*NS*LB; long row=0;
 for(long i=0;i<NS*LB;i++)z[i]=Z0[blk*NS*LB+i];
 for(long i=0;i<NC*COLUMN;i++)d[i]=0.0;
 for(long i=0;i<NS;i++)for(long b=0;b<LB;b++)d[(NF+i)*COLUMN+i*LB+b]=1.0;
 for(long t=0;t<T;t++){
  const double*a=S+blk*sb+t*st;
  if(t%every==0){for(long i=0;i<NS*LB;i++)o[i]=z[i]; o+=NS*LB;
   for(long b=0;b<LB;b++){double*c=D+((blk*LB+b)*rows+row)*NS*NC;
    for(long i=0;i<NS;i++)for(long k=0;k<NC;k++)c[i*NC+k]=d[k*COLUMN+i*LB+b];} row++;}
  if(t==T-1)break;
  jac_held(a,q,P,held); jac(z,a,q,P,held,y);
  if(!rk4){
   for(long i=0;i<NS*LB;i++)z[i]+=dt*y[i];
   for(long k=0;k<NC;k++){double*s=d+k*COLUMN; slope(y,s,k,v); for(long i=0;i<COLUMN;i++)s[i]+=dt*v[i];}
  }else{
   for(long i=0;i<NS*LB;i++){g[i]=y[i];w[i]=z[i]+0.5*dt*y[i];} jac(w,a,q,P,held,y+J);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*y[J+i];w[i]=z[i]+0.5*dt*y[J+i];} jac(w,a,q,P,held,y+2*J);
   for(long i=0;i<NS*LB;i++){g[i]+=2.0*y[2*J+i];w[i]=z[i]+dt*y[2*J+i];} jac(w,a,q,P,held,y+3*J);
   for(long i=0;i<NS*LB;i++)z[i]+=dt/6.0*(g[i]+y[3*J+i]);
   /* a column through all stages while it is in the registers: stage by stage all columns pass memory four times */
   for(long k=0;k<NC;k++){double*s=d+k*COLUMN;
    slope(y,s,k,v);     for(long i=0;i<COLUMN;i++){h[i]=v[i];w[i]=s[i]+0.5*dt*v[i];}
    slope(y+J,w,k,v);   for(long i=0;i<COLUMN;i++){h[i]+=2.0*v[i];w[i]=s[i]+0.5*dt*v[i];}
    slope(y+2*J,w,k,v); for(long i=0;i<COLUMN;i++){h[i]+=2.0*v[i];w[i]=s[i]+dt*v[i];}
    slope(y+3*J,w,k,v); for(long i=0;i<COLUMN;i++)s[i]+=dt/6.0*(h[i]+v[i]);}
  }}}}
