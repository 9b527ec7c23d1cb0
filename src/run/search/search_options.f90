! SPDX-License-Identifier: MIT
!> What a search for the critical factor varies, and between which values.
module rockdda_run_search_options
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : unset_integer, unset_real, is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: search_options_type, search_kind, search_names, scale_model, default_tolerance, usual_max_steps

   type :: search_kind_enum
      integer :: strength = 1   !! tan(phi), cohesion and tension of joints divided by the value
      integer :: tilt = 2       !! all weights turned by the value [deg], counter-clockwise
      integer :: push = 3       !! a horizontal load of the value times the weight on every block, in +x
      integer :: gravity = 4    !! all weights multiplied by the value
   end type search_kind_enum
   type(search_kind_enum), parameter :: search_kind = search_kind_enum()
   character(len=*), parameter :: search_names(4) = [character(len=8) :: 'strength', 'tilt', 'push', 'gravity']

   !> Steps of a trial, and of the search for the settled state where the model says nothing.
   integer, parameter :: usual_max_steps = 5000

   type :: search_options_type
      integer :: kind = 1                        !! one of search_kind%...
      character(len=:), allocatable :: joints    !! names or numbers of joint materials; empty: all
      character(len=:), allocatable :: stage     !! name of the last stage before the search; empty: the last one
      real(wp) :: from = unset_real, to = unset_real
      real(wp) :: tolerance = unset_real
      integer :: jobs = 1                        !! trials at a time
      integer :: max_steps = unset_integer       !! of a trial
   end type search_options_type

contains

   !> Largest distance between the value at which the model is stable and that at which it fails.
   pure real(wp) function default_tolerance(kind)
      integer, intent(in) :: kind    !! one of search_kind%...
      select case (kind)
      case (search_kind%tilt); default_tolerance = 0.1_wp
      case (search_kind%push); default_tolerance = 0.005_wp
      case default; default_tolerance = 0.01_wp
      end select
   end function default_tolerance

   !> Change the parameters of the model to those of a trial.
   pure subroutine scale_model(kind, value, chosen, parameters)
      integer, intent(in) :: kind               !! one of search_kind%...
      real(wp), intent(in) :: value
      logical, intent(in) :: chosen(:)          !! (joint materials) those with reduced strength
      type(parameters_type), intent(inout) :: parameters
      real(wp) :: angle
      integer :: i
      select case (kind)
      case (search_kind%strength)
         do i = 1, size(chosen)
            if (chosen(i)) parameters%joint_materials(i)%reduction = value
         end do
      case (search_kind%tilt)
         angle = value*pi/180
         parameters%weight_direction = [sin(angle), -cos(angle)]
      case (search_kind%push)
         parameters%weight_direction = [value, -1.0_wp]
      case (search_kind%gravity)
         parameters%weight_direction = [0.0_wp, -value]
      end select
   end subroutine scale_model

end module rockdda_run_search_options
