! SPDX-License-Identifier: MIT
!> The part of a model that a search changes, and how a value of the searched quantity changes it.
module rockdda_run_searched
   use rockdda_base_kinds, only : wp, pi
   use rockdda_model_parameters, only : parameters_type
   use rockdda_run_given_loads, only : given_loads_type, multiply_loads, name_length
   use rockdda_run_search_options, only : search_kind
   implicit none
   private
   public :: searched_type

   !> Joints without a stiffness of their own are stiffer by this factor in a search of the load: the hinges of an arch
   !> lie at the edges of its joints and sink there, which makes it flatter. The load on the crown of 31 voussoirs (t/R
   !> = 0.1, E = 10 GPa) is 3.7 % too small without it, and less than 1 % with it.
   real(wp), parameter :: stiffening = 16.0_wp

   type :: searched_type
      integer :: kind = 1                        !! one of search_kind%...
      logical, allocatable :: joints(:)          !! joint materials with reduced strength
      real(wp) :: factors(3) = 1                 !! tan(phi), cohesion, tension are divided by these as well
      type(given_loads_type) :: loads            !! of the model
      character(len=name_length), allocatable :: load_names(:)   !! of those that are multiplied
      logical :: springs = .false.               !! joints without a stiffness of their own are springs, no edges bear
   contains
      procedure :: scale => scale_model
      procedure :: value_at_rest
   end type searched_type

contains

   !> Change the parameters of the model to those of a trial.
   pure subroutine scale_model(self, value, parameters)
      class(searched_type), intent(in) :: self
      real(wp), intent(in) :: value
      type(parameters_type), intent(inout) :: parameters
      real(wp) :: angle
      integer :: i
      ! the verdict of a trial cannot distinguish the slip of a joint that opens, step by step, from a failure
      parameters%closed_part_slips = .false.
      if (self%springs) parameters%joint_materials%edge_bears = .false.
      select case (self%kind)
      case (search_kind%strength)
         do i = 1, size(self%joints)
            if (self%joints(i)) parameters%joint_materials(i)%reduction = value*self%factors
         end do
      case (search_kind%tilt)
         angle = value*pi/180
         parameters%weight_direction = [sin(angle), -cos(angle)]
      case (search_kind%push)
         parameters%weight_direction = [value, -1.0_wp]
      case (search_kind%gravity)
         parameters%weight_direction = [0.0_wp, -value]
      case (search_kind%load)
         call multiply_loads(self%loads, self%load_names, value, parameters)
         parameters%stiffening = stiffening
      end select
   end subroutine scale_model

   !> The value with which the model comes to rest before the search.
   pure real(wp) function value_at_rest(self, strength)
      class(searched_type), intent(in) :: self
      real(wp), intent(in) :: strength           !! times that of the model
      select case (self%kind)
      case (search_kind%strength, search_kind%gravity)
         value_at_rest = 1/strength
      case default
         value_at_rest = 0
      end select
   end function value_at_rest

end module rockdda_run_searched
