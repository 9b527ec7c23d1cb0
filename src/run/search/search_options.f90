! SPDX-License-Identifier: MIT
!> What a search for the critical factor varies, and between which values.
module rockdda_run_search_options
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : unset_integer, unset_real, is_set
   implicit none
   private
   public :: search_options_type, search_kind, search_names, default_tolerance, usual_max_steps

   type :: search_kind_enum
      integer :: strength = 1   !! tan(phi), cohesion and tension of joints divided by the value
      integer :: tilt = 2       !! all weights turned by the value [deg], counter-clockwise
      integer :: push = 3       !! a horizontal load of the value times the weight on every block, in +x
      integer :: gravity = 4    !! all weights multiplied by the value
      integer :: load = 5       !! loads that have a name multiplied by the value
   end type search_kind_enum
   type(search_kind_enum), parameter :: search_kind = search_kind_enum()
   character(len=*), parameter :: search_names(5) = [character(len=8) :: 'strength', 'tilt', 'push', 'gravity', 'load']

   !> Steps of a trial, and of the search for the settled state where the model says nothing.
   integer, parameter :: usual_max_steps = 5000

   type :: search_options_type
      integer :: kind = 1                        !! one of search_kind%...
      character(len=:), allocatable :: joints    !! names or numbers of joint materials; empty: all
      character(len=:), allocatable :: stage     !! name of the last stage before the search; empty: the last one
      character(len=:), allocatable :: loads     !! names of loads; empty: all that have one
      character(len=:), allocatable :: factors   !! of a design, as the command line has them; empty: none
      real(wp) :: from = unset_real, to = unset_real
      real(wp) :: tolerance = unset_real         !! of loads a share of the value
      integer :: jobs = 1                        !! trials at a time
      integer :: max_steps = unset_integer       !! of a trial
   contains
      procedure :: has_factors
   end type search_options_type

contains

   !> Largest distance between the value at which the model is stable and that at which it fails. With design factors it
   !> is that of the reserve, which is near 1 where it matters.
   pure real(wp) function default_tolerance(options)
      class(search_options_type), intent(in) :: options
      select case (options%kind)
      case (search_kind%tilt); default_tolerance = 0.1_wp
      case (search_kind%push, search_kind%load); default_tolerance = 0.005_wp
      case default; default_tolerance = 0.01_wp
      end select
      if (options%has_factors()) default_tolerance = 0.002_wp
   end function default_tolerance

   !> Is a design judged, with the factors of a code?
   pure logical function has_factors(self)
      class(search_options_type), intent(in) :: self
      has_factors = .false.
      if (allocated(self%factors)) has_factors = len_trim(self%factors) > 0
   end function has_factors

end module rockdda_run_search_options
