static long look(in z,const void*const*W,double*f,long*seen){
 const double*G=W[0],*T=W[1],*E=W[3]; const long*C=W[2]; const long nx=(long)G[3],ny=(long)G[4]; long close=0;
 for(long b=0;b<LB;b++){
  double x=(z[b]-G[0])*G[2],y=(z[LB+b]-G[1])*G[2];
  x=x>0.0?(x<nx-1.0?x:nx-1.0):0.0; y=y>0.0?(y<ny-1.0?y:ny-1.0):0.0;
  long i=(long)x,j=(long)y; i=i<nx-2?i:nx-2; j=j<ny-2?j:ny-2; x-=i; y-=j;
  const double*p=T+(i*ny+j)*NF,*r=p+ny*NF;
  for(long c=0;c<NF;c++)f[c*LB+b]=(1.0-x)*((1.0-y)*p[c]+y*p[NF+c])+x*((1.0-y)*r[c]+y*r[NF+c]);
  const long k=C[i*(ny-1)+j]; close|=k;
  if(k!=seen[b]){seen[b]=k; seen[LB]=1; for(long c=0;c<NE;c++)f[(NF+c)*LB+b]=E[k*NE+c];}
 }
 return close;}
